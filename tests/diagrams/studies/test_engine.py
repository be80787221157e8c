"""One root seed, one table: however it is played, and however often it is interrupted."""

import itertools
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import distributed
import psutil
import pytest

from sightfield.diagrams.studies import engine
from sightfield.diagrams.studies.engine import blocks_of, run_study
from sightfield.diagrams.studies.play import play_block
from sightfield.diagrams.studies.records import StudyResult, load_study, recorded_study
from sightfield.diagrams.studies.team_studies import assignment_study
from sightfield.systems.numerics.errors import InvalidInput

SIGHTFIELD = Path(sys.executable).with_name("sightfield")

RUNS = 6


@pytest.fixture
def small_blocks(monkeypatch):
    """Blocks of two runs."""
    monkeypatch.setattr(engine, "GAMES_PER_BLOCK", 6)


@pytest.fixture(scope="module")
def reference(make_study, tmp_path_factory):
    """The table as played in this process, in one block."""
    return run_study(make_study(RUNS), tmp_path_factory.mktemp("reference"), workers=0).table


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster on loopback: a worker process with two threads."""
    options = {"dashboard_address": ":0", "threads_per_worker": 2, "silence_logs": 50}
    with distributed.LocalCluster(n_workers=1, processes=True, **options) as local:
        yield local


def test_the_table_has_a_row_for_every_game(reference):
    numbers = {"1v1": RUNS, "1v2": RUNS, "2v2-random": 4}
    expected = [(name, run) for name, number in numbers.items() for run in range(number)]
    rows = zip(reference["cell"].to_pylist(), reference["run"].to_pylist(), strict=True)
    assert list(rows) == expected
    times, horizon = reference["time"].to_numpy(), reference["horizon"].to_numpy()
    censored = reference["censored"].to_numpy()
    assert (times[censored] == horizon[censored]).all()
    assert (times[~censored] < horizon[~censored]).all()
    assert 0 < censored.sum() < len(censored)


@pytest.mark.parametrize("workers", [1, 2])
def test_one_and_two_workers_give_the_same_table(
    workers, reference, make_study, tmp_path, small_blocks, monkeypatch
):
    """Though a worker is replaced by a fresh one, lest it grow, after two of the three blocks."""
    monkeypatch.setattr(engine, "GAMES_PER_PROCESS", 12)
    started, told = [], []
    make_pool = engine.worker_pool

    def start(*words, **options):
        started.append(words)
        return make_pool(*words, **options)

    monkeypatch.setattr(engine, "worker_pool", start)
    study = make_study(RUNS)
    result = run_study(study, tmp_path, workers=workers, progress=lambda *at: told.append(at))
    assert result.table.equals(reference)
    # The last block lacks the two runs that one of the cells has not; two workers may end it before
    # another.
    done = [runs for runs, of in told if of == 16]
    assert len(done) == len(told)
    assert sorted(b - a for a, b in itertools.pairwise(done)) == [4, 6, 6]
    assert (done[0], done[-1]) == (0, 16)
    assert workers == 2 or done == [0, 6, 12, 16]
    assert len(started) == 2


def test_a_dask_cluster_gives_the_same_table(
    reference, make_study, tmp_path, small_blocks, cluster
):
    result = run_study(make_study(RUNS), tmp_path, cluster=cluster.scheduler_address)
    assert result.table.equals(reference)


def test_blocks_that_are_there_are_not_played_again(
    reference, make_study, tmp_path, small_blocks, monkeypatch
):
    study, played = make_study(RUNS), []

    def play_two(*block):
        if len(played) == 2:
            raise KeyboardInterrupt
        played.append(block[1:])
        return play_block(*block)

    play_block = engine.play_block
    monkeypatch.setattr(engine, "play_block", play_two)
    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path, workers=0)
    kept = sorted(file.name for file in (tmp_path / "blocks").iterdir())
    assert kept == ["runs_000000_000002.parquet", "runs_000002_000004.parquet"]
    # One of them did not survive.
    (tmp_path / "blocks" / kept[0]).write_bytes(b"PAR1")
    played.clear()
    assert run_study(study, tmp_path, workers=0).table.equals(reference)
    assert played == [(0, 2), (4, 6)]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["study.json", "table.parquet"]


def test_a_cell_with_fewer_runs_has_the_first_of_those_that_it_would_have(reference, make_study):
    study = make_study(RUNS)
    all_alike = replace(study, cells=tuple(replace(cell, runs=None) for cell in study.cells))
    rows = play_block(all_alike, 0, RUNS)
    walked = [k for k, name in enumerate(rows["cell"]) if name == "2v2-random"]
    found = StudyResult(study, reference)
    assert found.times("2v2-random").tolist() == [rows["time"][k] for k in walked[:4]]
    assert found.rows("1v2")["run"].to_pylist() == list(range(RUNS))


def test_a_finished_study_is_read_and_not_played(make_study, tmp_path, monkeypatch):
    study = make_study(1)
    first = run_study(study, tmp_path, workers=0)
    monkeypatch.setattr(engine, "play_block", None)
    assert run_study(study, tmp_path, workers=0).table.equals(first.table)
    assert load_study(tmp_path).study == study


def test_another_study_is_refused_in_the_same_folder(make_study, tmp_path):
    run_study(make_study(1), tmp_path, workers=0)
    with pytest.raises(InvalidInput, match=r"`out` must hold the same study.* another seed was"):
        run_study(make_study(1, seed=12), tmp_path, workers=0)
    with pytest.raises(InvalidInput, match=r"another runs and seed was chosen"):
        run_study(make_study(2, seed=12), tmp_path, workers=0)


def test_an_unfinished_study_is_not_loaded(make_study, tmp_path):
    engine.records.open_records(make_study(1), tmp_path)
    with pytest.raises(InvalidInput, match="`study` must be finished"):
        load_study(tmp_path)


def test_an_error_in_a_worker_reaches_the_caller(make_study, tmp_path):
    study = make_study(1)
    driven = replace(study.cells[0], settings=("evaders.policies=[you]",))
    with pytest.raises(InvalidInput, match=r"without a page.*\(in cell 1v1, run 0\)"):
        run_study(replace(study, cells=(driven,)), tmp_path, workers=1)


def test_no_scheduler_is_an_error_in_one_line(make_study, tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "CLUSTER_TIMEOUT", 1)
    with pytest.raises(InvalidInput, match="`cluster` must be the address of a Dask scheduler"):
        run_study(make_study(1), tmp_path, cluster="tcp://127.0.0.1:9")


def begin(folder: Path) -> subprocess.Popen:
    """Start a study of three blocks from the command line."""
    words = ["study", "assignment", "--opponent", "adversarial", "--runs", "9", "--seconds", "2"]
    # Tests that run in the background of a shell would hand on that Ctrl-C is ignored.
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return subprocess.Popen(
        [SIGHTFIELD, *words, "--workers", "1", "--out", folder],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        process_group=0,
    )


def await_first_block(folder: Path) -> None:
    deadline = time.monotonic() + 120.0
    while not list(folder.glob("blocks/runs_*.parquet")):
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_killed_study_resumes_to_the_same_table(tmp_path):
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    process = begin(killed)
    await_first_block(killed)
    children = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.communicate()
    # Those who played for it do not stay.
    assert psutil.wait_procs(children, timeout=60.0)[1] == []
    assert not (killed / "table.parquet").exists()
    before = {file: file.stat().st_mtime_ns for file in killed.glob("blocks/*")}
    assert before
    study = recorded_study(killed)
    assert study.cells == assignment_study(runs=1, opponents=("adversarial",)).cells
    assert len(blocks_of(study)) == 3
    resumed = run_study(study, killed, workers=0)
    assert resumed.table.equals(run_study(study, whole, workers=0).table)


def test_an_interrupted_study_keeps_what_was_played_and_says_how_to_go_on(tmp_path):
    process = begin(tmp_path)
    await_first_block(tmp_path)
    # As a terminal does it: to all that belong to the command.
    os.killpg(process.pid, signal.SIGINT)
    told, _ = process.communicate(timeout=120.0)
    assert process.returncode not in (0, 2), told
    assert "Finishing the games that are being played; Ctrl-C again drops them." in told
    assert f"Go on with: sightfield study assignment --resume {tmp_path}" in told.replace("\n", "")
    # The first block, and the second if it had begun; the third never did.
    kept = {file.name for file in tmp_path.glob("blocks/*")}
    assert len(kept) in (1, 2)
    assert all(name.endswith(".parquet") for name in kept)
    assert not (tmp_path / "table.parquet").exists()


def run_program(text: str, folder: Path) -> subprocess.CompletedProcess:
    """Run a program that plays a study into `study`, in a group of its own."""
    (folder / "program.py").write_text(text)
    return subprocess.run(
        [sys.executable, folder / "program.py", folder / "study"],
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
        process_group=0,
    )


# A program that is interrupted whenever a worker is being started.
INTERRUPTED = """
import os, signal, sys
from multiprocessing import popen_forkserver
from pathlib import Path
from sightfield.diagrams.studies.engine import run_study
from sightfield.diagrams.studies.study import Cell, Study
from sightfield.diagrams.studies.team_studies import thesis_base

launch = popen_forkserver.Popen._launch

def interrupt(self, process):
    os.killpg(0, signal.SIGINT)
    launch(self, process)

if __name__ == "__main__":
    popen_forkserver.Popen._launch = interrupt
    study = Study(name="one", base=thesis_base(1.0), cells=(Cell(name="1v1"),), runs=1, seed=1)
    try:
        run_study(study, Path(sys.argv[1]), workers=1)
    except KeyboardInterrupt:
        print("interrupted")
"""


def test_a_study_that_is_interrupted_as_it_begins_leaves_nobody_who_complains(tmp_path):
    done = run_program(INTERRUPTED, tmp_path)
    assert done.stdout == "interrupted\n", done.stderr
    assert done.stderr == ""
    # What had been given to the worker was played and kept.
    assert len(list(tmp_path.glob("study/blocks/*.parquet"))) == 1


# A program that is interrupted twice while a worker plays for minutes.
INTERRUPTED_TWICE = """
import os, signal, sys
from pathlib import Path
from sightfield.diagrams.studies.engine import run_study
from sightfield.diagrams.studies.study import Cell, Study
from sightfield.diagrams.studies.team_studies import thesis_base

def interrupt(*_):
    os.kill(os.getpid(), signal.SIGINT)

if __name__ == "__main__":
    study = Study(
        name="long", base=thesis_base(2000.0), cells=(Cell(name="1v1"),), runs=64, seed=1
    )
    signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 4.0)
    try:
        run_study(study, Path(sys.argv[1]), workers=1, interrupted=interrupt)
    except KeyboardInterrupt:
        print("interrupted")
"""


def test_a_second_interruption_drops_what_is_being_played(tmp_path):
    done = run_program(INTERRUPTED_TWICE, tmp_path)
    assert (done.stdout, done.stderr) == ("interrupted\n", "")
    assert list(tmp_path.glob("study/blocks/*.parquet")) == []

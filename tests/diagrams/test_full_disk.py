"""What a full disk leaves: one line, exit code 2, and what was finished before.

A limit on the size of files stands for the disk: the system then refuses to write, for real.
"""

import errno
import json
import os
import resource
import subprocess
import sys

import pyarrow.parquet as pq
import pytest

from sightfield.diagrams.commands.app import main
from sightfield.diagrams.studies.play import play_block

# Runs command lines one after the other in one process, with files of the given size at most from
# the second on. The first compiles what the others need, as caches are files too.
LIMITED = """
import json, resource, sys
from sightfield.diagrams.commands.app import main
room, *lines = json.loads(sys.argv[1])
codes = []
for line in lines:
    sys.argv[1:] = line
    try:
        main()
    except SystemExit as end:
        codes.append(end.code)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
assert codes == [0] + [2] * (len(lines) - 1), codes
"""

TRACK = ("track", "corner_1v1", "--seconds", "0.5", "--meshcat", "--realtime", "0", "--out")
STUDY = ("study", "assignment", "--opponent", "adversarial", "--seconds", "0.2", "--workers", "0")
RUNS = ("--runs", "8", "--out")


def limited(room: int, *lines: tuple[str, ...]) -> str:
    """What command lines say on standard error; all but the first have little room and fail."""
    words = [sys.executable, "-c", LIMITED, json.dumps([room, *lines])]
    done = subprocess.run(words, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stderr


def run_here(monkeypatch, *words: str) -> object:
    """Exit code of a command line in this process."""
    monkeypatch.setattr(sys, "argv", ["sightfield", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code


# Too small for the first file; for the replay alone.
@pytest.mark.parametrize("room", [20, 200_000])
def test_a_run_without_room_for_its_files_leaves_nothing(room, tmp_path):
    out = tmp_path / "results" / "out"
    said = limited(room, (*TRACK, str(tmp_path / "roomy")), (*TRACK, str(out)))
    assert said == f"error: `out` must have room for the results; got {out} (File too large)\n"
    assert [each.name for each in tmp_path.iterdir()] == ["roomy"]


def test_a_study_without_room_for_its_pictures_keeps_its_games(tmp_path, monkeypatch):
    roomy, out = tmp_path / "roomy", tmp_path / "out"
    said = limited(20_000, (*STUDY, *RUNS, str(roomy)), (*STUDY, *RUNS, str(out)))
    assert said == (
        f"error: `out` must have room for the results; got {out} (File too large); "
        f"with room go on with: sightfield study assignment --resume {out}\n"
    )
    assert {each.name for each in out.glob("[!.]*")} == {"study.json", "table.parquet"}
    assert run_here(monkeypatch, "study", "assignment", "--resume", str(out)) == 0
    assert pq.read_table(out / "table.parquet").equals(pq.read_table(roomy / "table.parquet"))
    names = [sorted(each.name for each in folder.iterdir()) for folder in (roomy, out)]
    assert names[0] == names[1]


def test_a_study_whose_disk_fills_up_keeps_its_blocks_and_goes_on(tmp_path, monkeypatch, capsys):
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert run_here(monkeypatch, *STUDY, *RUNS, str(whole)) == 0
    sync, synced = os.fsync, []

    def fill_up(file: int) -> None:
        # There is room for the settings and one block.
        if len(synced) == 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        synced.append(sync(file))

    capsys.readouterr()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fill_up)
        assert run_here(patch, *STUDY, *RUNS, str(out)) == 2
    assert capsys.readouterr().err == (
        f"error: `out` must have room for the results; got {out / 'blocks'} "
        "(No space left on device); "
        f"with room go on with: sightfield study assignment --resume {out}\n"
    )
    (block,) = (out / "blocks").iterdir()
    assert 0 < pq.read_table(block).num_rows < pq.read_table(whole / "table.parquet").num_rows
    played = []
    monkeypatch.setattr(
        "sightfield.diagrams.studies.engine.play_block",
        lambda study, start, stop: played.append(start) or play_block(study, start, stop),
    )
    resume = ("study", "assignment", "--resume", str(out), "--workers", "0")
    assert run_here(monkeypatch, *resume) == 0
    # The block that was there was not played again.
    assert played
    assert 0 not in played
    assert pq.read_table(out / "table.parquet").equals(pq.read_table(whole / "table.parquet"))


def test_a_study_that_could_not_begin_is_not_said_to_go_on(tmp_path):
    roomy, out = ((*STUDY, *RUNS, str(tmp_path / name)) for name in ("roomy", "out"))
    said = limited(10, roomy, out)
    assert said.startswith("error: `out` must have room for the results; got ")
    assert said.endswith(" (File too large)\n")


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_other_files_without_room_are_one_line_too(code, monkeypatch, capsys):
    def full(*_: object, **__: object) -> None:
        raise OSError(code, os.strerror(code), "some.cache")

    monkeypatch.setattr("sightfield.diagrams.commands.track.set_up_game", full)
    assert run_here(monkeypatch, "track") == 2
    assert capsys.readouterr().err == (
        f"error: `disk` must have room for what is written; got {os.strerror(code)}, some.cache\n"
    )


def test_what_else_goes_wrong_is_not_called_a_full_disk(monkeypatch):
    def broken(*_: object, **__: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr("sightfield.diagrams.commands.track.set_up_game", broken)
    monkeypatch.setattr(sys, "argv", ["sightfield", "track"])
    with pytest.raises(OSError, match="Input/output error"):
        main()


def test_a_full_standard_output_is_one_line(tmp_path):
    command = "from sightfield.diagrams.commands.app import main; main()"
    with (tmp_path / "help.txt").open("w") as file:
        done = subprocess.run(
            [sys.executable, "-c", command, "--help"],
            stdout=file,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)),
        )
    assert done.returncode == 2
    assert done.stderr == "error: `disk` must have room for what is written; got File too large\n"


def test_a_reader_that_has_read_enough_ends_the_command_silently():
    command = "from sightfield.diagrams.commands.app import main; main()"
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        done = subprocess.run(
            [sys.executable, "-c", command, "--help"], stdout=pipe, stderr=subprocess.PIPE
        )
    assert (done.returncode, done.stderr) == (1, b"")

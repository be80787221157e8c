"""`sightfield station` as a user meets it."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from sightfield.diagrams.commands.app import main
from sightfield.hardware_io.recording.log_records import ABOUT, MAGIC, SAMPLES, pack, records


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """The folder of a simulated run without a terminal, and what was printed."""
    out = tmp_path_factory.mktemp("station") / "deep" / "out"
    command = [Path(sys.executable).with_name("sightfield"), "station", "--simulate"]
    done = subprocess.run(
        [*command, "--seconds", "3", "--out", out, "--json"],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return out, json.loads(done.stdout)


@pytest.fixture
def station(monkeypatch, capsys):
    """A function that runs the command in this process: how it ended and what it printed."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["sightfield", "station", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return SimpleNamespace(returncode=ended.value.code, stdout=out, stderr=err)

    return run


def test_a_run_leaves_its_folder_complete(simulated):
    out, summary = simulated
    names = {"run.log", "summary.json", "log.npz", "log_units.json", "tracks.png"}
    assert {each.name for each in out.glob("[!.]*")} == names
    assert json.loads((out / "summary.json").read_text()) == summary
    assert summary["mode"] == "simulate"
    assert summary["ended"] == "the horizon"
    assert summary["ticks"] == 61
    assert 0.9 < summary["poses_valid"] <= 1


def test_a_run_is_played_again_to_identical_commands(station, simulated, tmp_path):
    done = station("replay", simulated[0] / "run.log", "--json", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert (result["ticks"], result["identical"], result["differing"]) == (61, True, [])
    assert json.loads((tmp_path / "summary.json").read_text()) == result


def test_a_replay_that_differs_says_where(station, simulated, tmp_path):
    # The recording claims another risk vector than it was made with.
    data = (simulated[0] / "run.log").read_bytes()
    found = list(records(data))
    about = json.loads(found[0].body)
    about["about"]["scenario"]["tracking"]["pursuers"]["field"] = "table"
    others = [pack(each.kind, each.time, each.body) for each in found[1:]]
    changed = tmp_path / "changed.log"
    changed.write_bytes(b"".join([MAGIC, pack(ABOUT, 0.0, json.dumps(about).encode()), *others]))
    done = station("replay", changed)
    assert done.returncode == 1
    assert "commands differ from tick" in done.stdout


def test_a_run_that_was_broken_off_is_played_as_far_as_it_goes(station, simulated, tmp_path):
    data = (simulated[0] / "run.log").read_bytes()
    (tmp_path / "cut.log").write_bytes(data[: len(data) // 2])
    done = station("replay", tmp_path / "cut.log")
    assert done.returncode == 0, done.stderr
    assert "every command is the same, bit for bit" in done.stdout
    assert "The run was broken off" in done.stdout


def test_a_damaged_log_is_played_as_far_as_its_bytes_tell_and_is_a_failure(
    station, simulated, tmp_path
):
    data = bytearray((simulated[0] / "run.log").read_bytes())
    tenth = [each for each in records(bytes(data)) if each.kind == SAMPLES][10]
    data[tenth.start + 20] ^= 1
    (tmp_path / "damaged.log").write_bytes(data)
    done = station("replay", tmp_path / "damaged.log")
    assert done.returncode == 1
    assert "60 ticks, and every command is the same, bit for bit." in done.stdout
    assert "The log is damaged: 1 of its records lost" in done.stdout


def test_a_log_is_never_written_over(station, simulated):
    done = station("--seconds", 1, "--out", simulated[0])
    assert done.returncode == 2
    assert "have no run.log, which is never written over" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--hardware", "--set", "radio.port=/dev/ttyNOTHING"), "/dev/ttyNOTHING"),
        (("--emulate", "--hardware"), "must come alone; got --emulate, --hardware"),
        (("--emulate", "--realtime", "2"), "`--realtime` must be left out with --emulate; got 2"),
        (("--no-go",), "`--no-go` must come with a view or a terminal; got neither"),
        (("nonsense",), "`scenario` must be a YAML file or one of thesis_3v3; got nonsense"),
        (("--simulate", "--set", "radio.kind=foo"), "`radio.kind` must be one of"),
        (("--set", "mocap.source=sonar"), "`mocap.source` must be one of"),
        (("replay", "nothing.log"), "`log` must be a readable file; got nothing.log"),
        (("--view", "--port", "80"), "`--port` must be from 1024 to 65535; got 80"),
        (("--drive-to-start",), "must come with --emulate or --hardware"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(station, arguments, message):
    done = station(*arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_a_check_says_in_plain_words_what_is_missing(station):
    settings = ("--set", "radio.port=/dev/ttyNOTHING", "--set", "mocap.source=mock")
    done = station("check", "--json", *settings)
    assert done.returncode == 1
    assert done.stderr == ""
    result = json.loads(done.stdout)
    findings = {each["thing"]: each for each in result["findings"]}
    assert not result["ready"]
    assert "/dev/ttyNOTHING is not there" in findings["serial port"]["words"]
    assert not findings["radio and robots"]["found"]
    assert findings["motion capture"]["words"].startswith("mock is connected, but does not see")
    assert findings["omni-camera"]["words"] == "the scenario has none"


def test_help_names_all_that_can_be_done(station):
    done = station("--help")
    assert done.returncode == 0
    words = ("run", "check", "convert", "identify", "kind-check", "replay", "view")
    assert all(f"  {word} " in done.stdout for word in words)
    assert "--emulate" in station("run", "--help").stdout

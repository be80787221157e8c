"""The command's subcommands."""

import io
import logging
import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import COMMANDS, import_command, make_app
from sightfield.systems.numerics.errors import InvalidInput


@pytest.mark.parametrize("name", COMMANDS)
def test_each_subcommand_says_what_it_does(name):
    result = CliRunner().invoke(make_app(), [name, "--help"])
    assert result.exit_code == 0
    assert f"{name} [OPTIONS]" in result.stdout


def test_help_lists_every_subcommand_with_its_whole_line():
    stdout = CliRunner().invoke(make_app(), ["--help"]).stdout
    listed = dict(re.findall(r"^  (\w+) +(\w.*)$", stdout.partition("Commands:")[2], re.MULTILINE))
    assert listed == COMMANDS


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("harvest", ["audit", "plan", "run"]),
        ("camera", ["calibrate", "convert", "estimate", "render", "track"]),
        ("social", ["run", "server"]),
        ("standoff", ["analyse", "design", "live", "run", "simulate"]),
        ("station", ["check", "convert", "identify", "kind-check", "replay", "run", "view"]),
        ("study", ["assignment", "map", "policies", "tracking"]),
    ],
)
def test_a_command_with_parts_lists_them(name, parts):
    stdout = CliRunner().invoke(make_app(), [name, "--help"]).stdout
    assert sorted(re.findall(r"^  ([\w-]+)  ", stdout.partition("Commands:")[2], re.M)) == parts


def test_help_and_refusals_import_no_command():
    code = """
import sys
from sightfield.diagrams.commands.app import main
try:
    main()
except SystemExit:
    print("pydrake" in sys.modules)
"""
    for word in ("--help", "--version", "trak"):
        words = [sys.executable, "-c", code, word]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        assert done.stdout.splitlines()[-1] == "False", word


def test_the_version_is_the_installed_one():
    stdout = CliRunner().invoke(make_app(), ["--version"]).stdout
    assert stdout == f"sightfield {metadata.version('sightfield')}\n"


def test_a_word_that_is_no_subcommand_is_refused():
    command = Path(sys.executable).with_name("sightfield")
    done = subprocess.run([command, "trak"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "No such command 'trak'" in done.stderr


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("schedule", "--combines", "1.5"), "Invalid value for '--combines'"),
        (("schedule", "--combines", "2"), "Missing option '--capacity'"),
        (("schedule", "--fill"), "Option '--fill' requires an argument"),
        (("harvest", "run", "--nope"), "No such option: --nope"),
        (("harvest", "--combines", "1e308"), "Invalid value for '--combines'"),
        (("trak",), "No such command 'trak'"),
        (("station", "identify"), "`--emulate` or --hardware must say which robots; got neither"),
        (
            ("station", "identify", "--emulate", "--hardware"),
            "`--emulate` or --hardware must say which robots; got both",
        ),
    ],
    ids=lambda part: " ".join(part) if isinstance(part, tuple) else "",
)
def test_words_that_no_command_takes_are_refused_in_one_line(words, says, sightfield_here):
    done = sightfield_here(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith(f"error: {says}")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("track --seconds 5 --set seconds=1", "`seconds`|--set seconds=1 and --seconds"),
        ("track --seed 5 --set seed=5", "`seed`|--set seed=5 and --seed"),
        ("track --world w.wkt --set world.file=v.wkt", "`world.file`|world.file=v.wkt and --world"),
        (
            "track --world w.wkt --set evaders.positions=[]",
            "`evaders.positions`|--set evaders.positions=[] and --world",
        ),
        ("track --seconds 5 --seconds 6", "`--seconds`|it 2 times"),
        ("track --replay --no-replay", "`--replay/--no-replay`|it 2 times"),
        ("social --seconds 5 --set seconds=1", "`seconds`|--set seconds=1 and --seconds"),
        ("social --seed 1 --seed 1", "`--seed`|it 2 times"),
        (
            "camera track --weight 1 --set vision.weight=0",
            "`vision.weight`|--set vision.weight=0 and --weight",
        ),
        ("station --seconds 5 --set seconds=1", "`seconds`|--set seconds=1 and --seconds"),
        (
            "harvest --combines 3 --set combines.count=2",
            "`combines.count`|--set combines.count=2 and --combines",
        ),
        ("harvest plan --yield 1 --set density=2", "`density`|--set density=2 and --yield"),
        ("harvest --field F --set field.file=G", "`field.file`|--set field.file=G and --field"),
        ("harvest --yields F --set yields.file=G", "`yields.file`|yields.file=G and --yields"),
        ("harvest --part 1 --set field.part=2", "`field.part`|--set field.part=2 and --part"),
        (
            "harvest --set carts.machine=kinze-1100 --set carts.machine=kinze-1300",
            "`carts.machine`|machine=kinze-1100 and --set carts.machine=kinze-1300",
        ),
        ("guarantee --grid 1 --set pursuers.grid=2", "`pursuers.grid`|pursuers.grid=2 and --grid"),
        (
            "guarantee --speed-ratio 1 --set evaders.top_speed=2",
            "`evaders.top_speed`|--set evaders.top_speed=2 and --speed-ratio",
        ),
        ("study tracking --seconds 5 --set seconds=1", "`seconds`|--set seconds=1 and --seconds"),
        (
            "study tracking --world w.wkt --set world.file=v.wkt",
            "`world.file`|--set world.file=v.wkt and --world",
        ),
        (
            "study tracking --set arena.side=5 --set arena.side=4",
            "`arena.side`|--set arena.side=5 and --set arena.side=4",
        ),
        (
            "study map --set arena.side=5 --set arena.side=4",
            "`arena.side`|--set arena.side=5 and --set arena.side=4",
        ),
        ("study tracking --set seed=5", "`--set`|leave to the study what it varies: seed"),
        (
            "study tracking --opponent-runs random_walk=3 --opponent-runs random_walk=4",
            "`opponent-runs`|said once of random_walk; got 3 and 4",
        ),
        ("reproduce --runs 3 --runs 4", "`--runs`|it 2 times"),
    ],
    ids=lambda part: part.partition("|")[0],
)
def test_what_is_said_twice_is_refused_and_both_places_are_named(words, says):
    done = CliRunner().invoke(make_app(), words.split())
    name, places = says.split("|")
    assert isinstance(done.exception, InvalidInput)
    assert str(done.exception).startswith(f"{name} must ")
    assert places in str(done.exception)


def test_an_option_that_takes_several_values_may_stand_again():
    words = "track --set seed=1 --set seconds=0"
    done = CliRunner().invoke(make_app(), words.split())
    assert str(done.exception).startswith("`seconds` must be positive")


def test_where_a_command_is_to_be_named_there_is_help(sightfield_here):
    for words in ((), ("camera",)):
        done = sightfield_here(*words)
        assert "Commands:" in done.stdout + done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("track", "corner_1v1"),
        ("camera", "track", "--seconds", "1"),
        ("social", "--seconds", "1"),
    ],
    ids=lambda words: words[0],
)
def test_a_run_that_is_only_watched_leaves_no_replay(words, sightfield_here, tmp_path):
    options = ("--meshcat", "--no-replay", "--realtime", "0", "--out", tmp_path / "out")
    done = sightfield_here(*words, *options)
    assert done.returncode == 0, done.stderr
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert "summary.json" in names
    assert "replay.html" not in names


def test_on_a_terminal_the_package_says_what_takes_long(monkeypatch):
    log = logging.getLogger("sightfield")
    monkeypatch.setattr(log, "handlers", [])
    monkeypatch.setattr(log, "level", logging.NOTSET)
    import_command("schedule")
    assert not log.handlers
    monkeypatch.setattr(sys, "stderr", Terminal())
    for _ in range(2):
        import_command("schedule")
    logging.getLogger("sightfield.systems").info("compiling")
    assert sys.stderr.getvalue() == "compiling\n"


class Terminal(io.StringIO):
    """Takes what is written to it."""

    def isatty(self) -> bool:
        return True


def test_an_empty_word_for_a_folder_is_refused_where_the_current_one_was_taken(
    tmp_path, monkeypatch
):
    """As `--out "$FOLDER"` is where nobody has said what that is."""
    monkeypatch.chdir(tmp_path)
    words = "schedule --combines 2 --capacity 9 --fill-rate 1 --unload-rate 5 --travel-time 1 --out"
    done = CliRunner().invoke(make_app(), [*words.split(), ""])
    assert str(done.exception) == "`--out` must have a value; got an empty word"
    assert list(tmp_path.iterdir()) == []

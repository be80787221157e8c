"""The command's subcommands."""

import re
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import COMMANDS, make_app


@pytest.mark.parametrize("name", COMMANDS)
def test_each_subcommand_says_what_it_does(name):
    result = CliRunner().invoke(make_app(), [name, "--help"])
    assert result.exit_code == 0
    assert f"{name} [OPTIONS]" in result.stdout


def test_help_lists_every_subcommand_with_its_whole_line():
    stdout = CliRunner().invoke(make_app(), ["--help"]).stdout
    listed = dict(re.findall(r"^  (\w+) +(\w.*)$", stdout.partition("Commands:")[2], re.MULTILINE))
    assert listed == COMMANDS


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
    ],
    ids=lambda part: " ".join(part) if isinstance(part, tuple) else "",
)
def test_words_that_no_command_takes_are_refused_in_one_line(words, says, sightfield_here):
    done = sightfield_here(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith(f"error: {says}")
    assert done.stderr.count("\n") == 1


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

"""What the pages say can be typed, can be typed."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import COMMANDS, import_command, make_app

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()


def lines_of(page) -> list[str]:
    """The commands of ours in a page's `sh` blocks, without their comments."""
    lines = [line for kind, text in page.blocks if kind == "sh" for line in text.splitlines()]
    lines = [line.partition("#")[0].strip() for line in lines]
    return [line for line in lines if line.startswith("sightfield ")]


def alone(line: str) -> str:
    """A command without what it says of what it leaves and prints."""
    return re.sub(r" --out \S+| --json", "", line.partition("#")[0].strip())


README_COMMANDS = {alone(line) for line in README}


def is_in_the_readme(line: str) -> bool:
    """Whether the test of the README runs a command: as it stands, or with a folder beside it."""
    return line in README or ("--out" not in line and alone(line) in README_COMMANDS)


@pytest.fixture(scope="module")
def app() -> typer.Typer:
    """The whole command line."""
    return make_app()


def refusal(words: list[str]) -> str:
    """What is wrong with the words after `sightfield`; empty if they can be read."""
    if words[0] not in COMMANDS:
        return f"no command {words[0]}"
    command, rest = import_command(words[0]), words[1:]
    while rest and rest[0] in getattr(command, "commands", {}):
        command = command.commands[rest.pop(0)]
    if hasattr(command, "commands") and not command.invoke_without_command:
        return f"no command {rest[:1]}"
    try:
        command.make_context("sightfield", rest)
    except Exception as error:  # typer keeps its classes of errors private
        return str(error) or repr(error)
    return ""


def test_there_are_commands(pages):
    assert sum(len(lines_of(page)) for page in pages) > 10


def test_every_line_is_a_command(page):
    for line in lines_of(page):
        assert refusal(shlex.split(line)[1:]) == "", line


@pytest.mark.parametrize(
    "line",
    [
        "trak",
        "track --sped 3",
        "track a b",
        "camera look",
        "plan --start 1 1 0",
        "corner --ratio x",
    ],
)
def test_a_line_that_is_none_is_seen(line):
    assert refusal(shlex.split(line))


def test_commands_run_one_after_the_other(lesson, app, begun, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for kind, text in lesson.blocks:
        if kind == "yaml" and text.startswith("# "):
            name = text.partition("\n")[0].removeprefix("# ")
            Path(name).write_text(text, encoding="utf-8")
    for line in (line for line in lines_of(lesson) if not is_in_the_readme(line)):
        program, *words = shlex.split(line)
        words = begun(words)
        if words[0] == "station":
            # It looks for keys, and the runner's input is no file.
            program = Path(sys.executable).with_name(program)
            ran = subprocess.run([program, *words], stdin=subprocess.DEVNULL, check=False)
            assert ran.returncode == 0, line
            continue
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, f"{line}\n{done.output}\n{done.exception!r}"


def test_numbers_of_the_pages_are_what_the_commands_say(pages, app):
    """The figures that the stories give for the thesis's cases."""
    text = {page.name: page.text for page in pages}

    def answer(line):
        done = CliRunner().invoke(app, shlex.split(line))
        assert done.exit_code == 0, done.output
        return json.loads(done.stdout)

    corner = answer("corner --json")
    assert f"{corner['margin']:.2f} m" in text["stories/tracking.md"]
    assert f"{corner['escape_time']:.3f} s" in text["stories/tracking.md"]
    loop = answer("standoff --controller PD --analyse --json")
    for rest in loop["equilibria"]:
        assert f"{rest['y']:.3f} m" in text["stories/vision.md"]
        assert re.search(rf"pole\s+at\s+{rest['poles'][0][0]:.3g}\b", text["stories/vision.md"])
    assert f"{loop['singularities'][0]:.3f} m" in text["stories/vision.md"]
    fleet = "--combines 3 --capacity 9000 --fill-rate 20 --unload-rate 150 --travel-time 60"
    plan = answer(f"schedule {fleet} --json")
    for figure in (
        f"{plan['travel_time_max']:.1f} s",
        f"{plan['waiting_times'][0]:.1f} s",
        f"{plan['period']:.0f} s",
        f"{100 * plan['jitter_max']:.1f}%",
    ):
        assert figure in text["stories/harvest.md"]
    plans = answer("plan --start 1 1 0 0 --goal 4 4 0 0 --json")
    for method, found in plans["methods"].items():
        row = re.search(rf"(?m)^\| `{method}` .* ([\d.]+) \|$", text["stories/planning.md"])
        assert row, method
        assert found["time"] == pytest.approx(float(row[1]), abs=6e-4)
    assert f"{plans['lower_bound']:.3f}" in text["stories/planning.md"]
    for goal, words in (("inf", "beta free"), ("0.251", "beta) <= 0.251"), ("0", "the point")):
        found = answer(f"plan --goal-tolerance 0 0 0 {goal} --method extremal --json")
        time = found["methods"]["extremal"]["time"]
        assert re.search(
            rf"(?m)^\| .*{re.escape(words)} \| {time:.3f}\b", text["stories/planning.md"]
        )

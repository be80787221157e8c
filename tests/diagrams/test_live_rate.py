"""How fast a run goes is what `--help` says, watched or not, with a terminal or without."""

from importlib import import_module
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import COMMANDS, import_command, make_app
from sightfield.diagrams.harvest.job import HarvestJob, prepare_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario

# Each command that runs live: where it plays, and its rates when nobody watches and when somebody
# does, in the words of its help and in numbers.
LIVE = {
    ("track",): (
        "sightfield.diagrams.commands.track.run_tracking",
        "[default: 1 live, else 0]",
        0.0,
        1.0,
    ),
    ("camera", "track"): (
        "sightfield.diagrams.commands.camera.run_picture_tracking",
        "[default: 1 live, else 0]",
        0.0,
        1.0,
    ),
    ("harvest", "run"): ("sightfield.diagrams.harvest.run.run_harvest", "[default: 0.0]", 0.0, 0.0),
    ("social", "run"): (
        "sightfield.diagrams.commands.social.run_social_search",
        "[default: 1 with matrix, else 0]",
        0.0,
        0.0,
    ),
}


# Without which it would plan the thesis's field first.
SMALL_FIELD = {
    "field.width": 120,
    "field.height": 90,
    "combines.header_width": 9,
    "combines.turning_radius": 6,
}


class Played(Exception):
    """Ends a command where it would play, and tells the rate at which."""

    def __init__(self, rate: float) -> None:
        self.rate = rate


def options_of(command, path=()) -> dict[tuple[str, ...], dict[str, str]]:
    """Help of every option of a command and of its subcommands, by their names."""
    below = getattr(command, "commands", {})
    if below:
        return {
            names: options
            for name, each in below.items()
            for names, options in options_of(each, (*path, name)).items()
        }
    return {path: {each.opts[0]: getattr(each, "help", "") for each in command.params}}


def test_every_command_that_runs_live_is_looked_at():
    found = {
        path
        for name in COMMANDS
        for path, options in options_of(import_command(name), (name,)).items()
        if "--meshcat" in options
    }
    assert found == set(LIVE)


@pytest.fixture(scope="module")
def prepare_once():
    """Plans each harvest once: the rate is no part of what is planned."""
    jobs = {}

    def prepare(scenario: HarvestScenario, *others: object) -> HarvestJob:
        asked = repr(scenario)
        if asked not in jobs:
            jobs[asked] = prepare_harvest(scenario, *others)
        return jobs[asked]

    return prepare


@pytest.fixture
def rate(monkeypatch, prepare_once):
    """A function of a command and its options: the rate at which it plays."""
    monkeypatch.setattr("sightfield.diagrams.commands.harvest_run.prepare_harvest", prepare_once)

    def play(words: tuple[str, ...], *options: str) -> float:
        def stop(*_: object, realtime_rate: float, **__: object) -> None:
            raise Played(realtime_rate)

        import_command(words[0])
        module, _, name = LIVE[words][0].rpartition(".")
        monkeypatch.setattr(import_module(module), name, stop)
        settings = SMALL_FIELD if words[0] == "harvest" else {}
        small = [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]
        result = CliRunner().invoke(make_app(), [*words, *small, *options])
        assert isinstance(result.exception, Played), result.output
        return result.exception.rate

    return play


@pytest.mark.parametrize("words", LIVE, ids=" ".join)
def test_the_rate_is_the_one_of_the_help(words, rate):
    _, promise, unwatched, watched = LIVE[words]
    page = CliRunner().invoke(make_app(), [*words, "--help"]).stdout
    assert promise in " ".join(page.split())
    assert rate(words) == unwatched
    assert rate(words, "--no-meshcat") == unwatched
    assert rate(words, "--meshcat") == watched
    assert rate(words, "--meshcat", "--json") == watched


@pytest.mark.parametrize("words", LIVE, ids=" ".join)
def test_a_rate_that_is_asked_for_is_played(words, rate):
    for options in (("--meshcat",), ("--no-meshcat",)):
        assert rate(words, *options, "--realtime", "0") == 0.0
        assert rate(words, *options, "--realtime", "2.5") == 2.5


def test_in_a_terminal_a_run_is_watched_unless_it_is_not_wanted(rate, monkeypatch):
    monkeypatch.setattr(
        "sightfield.diagrams.commands.shared.sys",
        SimpleNamespace(stdin=Terminal(), stdout=Terminal()),
    )
    assert rate(("track",)) == 1.0
    assert rate(("track",), "--no-meshcat") == 0.0
    assert rate(("track",), "--json") == 0.0


class Terminal:
    """Standard input or output that is a terminal."""

    def isatty(self) -> bool:
        return True

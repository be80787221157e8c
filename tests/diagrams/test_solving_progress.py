"""The bar that is shown while a value function is solved."""

import io

import pytest
from rich.console import Console

from sightfield.diagrams.commands.solving import solving_shown


def console(*, terminal: bool) -> Console:
    """One that keeps what it writes."""
    return Console(file=io.StringIO(), force_terminal=terminal, width=100, color_system=None)


def written(screen: Console) -> str:
    file = screen.file
    assert isinstance(file, io.StringIO)
    return file.getvalue()


def test_a_terminal_sees_passes_and_changes():
    screen = console(terminal=True)
    with solving_shown(True, screen) as report:
        assert report is not None
        report(1, 1e12)
        report(7, 0.25)
    assert "pass 7" in written(screen)
    assert "change 0.2 s" in written(screen)


def test_where_nothing_is_solved_there_is_no_bar():
    screen = console(terminal=True)
    with solving_shown(True, screen) as report:
        assert report is not None
    assert "Value function" not in written(screen)


@pytest.mark.parametrize(("wanted", "terminal"), [(False, True), (True, False)])
def test_unwanted_or_unwatched_nothing_is_written(wanted, terminal):
    screen = console(terminal=terminal)
    with solving_shown(wanted, screen) as report:
        assert report is None
    assert written(screen) == ""

"""What the terminal shows while a value function is solved."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ...systems.numerics.planning.value_function.solve import Progress as Report

# A node that had no way to the goal before this pass changes by more than this [s].
_REACHING = 1e6


@contextmanager
def solving_shown(wanted: bool, console: Console | None = None) -> Iterator[Report | None]:
    """A bar while a value function is solved; it disappears at the end of the block.

    How many passes there will be is not known, so the bar only says that there are some, with
    their number and the largest change in the last of them.

    Args:
        wanted: Whether to show one.
        console: Where; by default standard error.

    Yields:
        What `solve_value_function` reports to; None where nothing is shown because it is not
        wanted, or because nobody watches: the console is no terminal.
    """
    console = console or Console(stderr=True)
    if not (wanted and console.is_terminal):
        yield None
        return
    columns = (
        TextColumn("Value function"),
        BarColumn(),
        TextColumn("pass {task.completed:.0f}, {task.fields[change]}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = None

        def report(number: int, change: float) -> None:
            nonlocal task
            words = f"change {change:.1g} s" if change < _REACHING else "reaching farther"
            # Planners that solve nothing leave the terminal as it is.
            if task is None:
                task = progress.add_task("", total=None, change=words)
            elif number == 1:
                progress.reset(task, total=None)
            progress.update(task, completed=number, change=words)

        yield report

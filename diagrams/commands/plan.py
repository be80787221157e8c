"""`sightfield plan`: several planners on one question, side by side."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from ...systems.numerics.errors import InvalidInput, require, require_positive
from ...systems.numerics.geometry.world_files import load_world
from ...systems.numerics.planning.footprint import discs_from_text
from ...systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from ...systems.numerics.planning.trailer import Trailer
from ...systems.numerics.planning.value_function.grid import THESIS_STEP
from ...systems.numerics.planning.value_function.solve import Progress as Report
from ..outputs import optional_folder, write_json
from ..planning.methods import METHODS, PlanningQuestion, chosen_methods, quarter_of_memory
from ..planning.pictures import save_sweep_picture
from ..planning.report import as_object, as_table, write_planning_report
from ..planning.sweep import DirectionSweep, sweep_ratios
from ..planning.verdict import PlanningVerdict, ask_methods, contradictions, status_of
from .shared import JsonOption, given_options, tell

plan = typer.Typer(
    help=(
        "Drive the grain cart from one configuration to another in the least time.\n\n"
        "Exit code 0: a planner arrives; 1: none does, with the reasons; 2: bad input."
    ),
    rich_markup_mode=None,
)
State = tuple[float, float, float, float]
_GRIDS = {"thesis": THESIS_STEP, "fine": THESIS_STEP / 2}
GridOption = Annotated[
    str, typer.Option(help="Of the value function: thesis, fine, or its step in turning radii.")
]
_METHOD_HELP = f"One of {', '.join([*METHODS, 'all'])}."


@plan.callback(invoke_without_command=True)
def compare_planners(
    context: typer.Context,
    start: Annotated[
        State, typer.Option(metavar="X Y THETA BETA", help="Where from [m], [m], [rad], [rad].")
    ] = (1.0, 1.0, 0.0, 0.0),
    goal: Annotated[
        State, typer.Option(metavar="X Y THETA BETA", help="Where to [m], [m], [rad], [rad].")
    ] = (4.0, 4.0, 0.0, 0.0),
    method: Annotated[str, typer.Option(help=_METHOD_HELP)] = "all",
    goal_tolerance: Annotated[
        State | None,
        typer.Option(
            metavar="DX DY DTHETA DBETA",
            help=(
                "Half-widths of the goal's box, along and across its heading; inf: free "
                "[default: a cell of the thesis's grid]."
            ),
        ),
    ] = None,
    point: Annotated[bool, typer.Option("--point", help="Reach the goal exactly.")] = False,
    reverse: Annotated[bool, typer.Option("--reverse", help="Drive backwards too.")] = False,
    speed: Annotated[float, typer.Option(help="Of the tractor [m/s].")] = 1.0,
    turn_rate: Annotated[float, typer.Option(help="Its bound [rad/s].")] = 1.0,
    length: Annotated[float, typer.Option(help="From hitch to trailer's axle [m].")] = 1.0,
    hitch_offset: Annotated[
        float, typer.Option(help="From the tractor's axle back to the hitch [m].")
    ] = 0.0,
    jackknife: Annotated[
        float,
        typer.Option(help="Largest angle of the trailer [rad]; pi: none, it may turn right round."),
    ] = math.pi,
    world: Annotated[
        Path | None, typer.Option(help="Keep clear of its walls (WKT, GeoJSON or ROS map).")
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(help="With --world: of the cart [m] [default: half of its length]."),
    ] = None,
    discs: Annotated[
        str | None,
        typer.Option(
            metavar="BODY AHEAD RADIUS, ...",
            help=(
                "With --world: what the cart covers instead, each disc so far ahead of its body's "
                "axle [m], [m]: 'tractor 0 0.4, tractor 0.5 0.4, trailer 0 0.5'."
            ),
        ),
    ] = None,
    grid: GridOption = "thesis",
    memory: Annotated[
        float | None,
        typer.Option(help="That a table may take [GB] [default: a quarter of the machine's]."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for results, plots and replay.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Ask one planner or all of them, and drive what they answer through the plant.

    Exit codes: see `plan`.
    """
    if context.invoked_subcommand is not None:
        _refuse_given(context)
        return
    require(
        not (point and goal_tolerance is not None),
        "--point",
        "stand without --goal-tolerance",
        goal_tolerance,
    )
    tolerance = (0.0, 0.0, 0.0, 0.0) if point else goal_tolerance or THESIS_TOLERANCE
    for name, given in (("width", width), ("discs", discs)):
        # In the open nothing asks how much room the cart takes.
        require(given is None or world is not None, f"--{name}", "come with --world", given)
    if memory is not None:
        require_positive("memory", memory)
    names = chosen_methods(method)
    trailer = Trailer(
        speed=speed,
        turn_rate=turn_rate,
        length=length,
        hitch_offset=hitch_offset,
        reverse=reverse,
        jackknife=jackknife,
    )
    question = PlanningQuestion(
        start=start,
        goal=Goal(state=goal, tolerance=tolerance),
        trailer=trailer,
        world=None if world is None else load_world(world).world,
        grid_step=_grid_step(grid),
        width=width,
        footprint=None if discs is None else discs_from_text(trailer, discs),
        memory=quarter_of_memory() if memory is None else 1e9 * memory,
    )
    with optional_folder(out) as folder:
        with solving_shown(not as_json) as progress:
            verdict = ask_methods(replace(question, progress=progress), names)
        written = [] if folder is None else write_planning_report(verdict, folder)
    remarks = [Text(f"Contradiction: {sentence}") for sentence in contradictions(verdict)]
    said, table = as_object(verdict), as_table(verdict)
    tell(said, table, *remarks, as_json=as_json, written=written, out=out)
    if math.isinf(verdict.best_time):
        typer.echo(f"no plan: {_refusals(verdict)}", err=True)
        raise typer.Exit(1)


@plan.command()
def sweep(
    method: Annotated[str, typer.Option(help=_METHOD_HELP)] = "all",
    goal_tolerance: Annotated[
        State, typer.Option(metavar="DX DY DTHETA DBETA", help="Half-widths of the goal's box.")
    ] = THESIS_TOLERANCE,
    count: Annotated[int, typer.Option(help="Number of ratios from 0.5 to 3.")] = 26,
    grid: GridOption = "thesis",
    out: Annotated[Path | None, typer.Option(help="Folder for sweep.json and sweep.png.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Travel time over the ratio (x_g - x_i) / (y_g - y_i), y_g - y_i = 4 (Figure 3.10)."""
    names, step = chosen_methods(method), _grid_step(grid)
    with optional_folder(out) as folder:
        with solving_shown(not as_json) as progress:
            results = sweep_ratios(names, goal_tolerance, count, step, progress)
        if folder is not None:
            write_json(folder / "sweep.json", results.as_object())
            save_sweep_picture(folder / "sweep.png", results)
    shown = [_sweep_table(results)] if out is None else [Text(each) for each in results.remarks]
    written = ("sweep.json", "sweep.png")
    tell(results.as_object(), *shown, as_json=as_json, written=written, out=out)


def _refusals(verdict: PlanningVerdict) -> str:
    """What each planner says, in one line."""
    return "; ".join(f"{row.method}: {status_of(verdict, row)}" for row in verdict.rows)


def _refuse_given(context: typer.Context) -> None:
    """Refuse options that stand before a subcommand, which has its own."""
    names = given_options(context)
    given = [option.opts[0] for option in context.command.params if option.name in names]
    what = f"stand without {', '.join(given)} before it"
    require(not given, f"plan {context.invoked_subcommand}", what, "both")


def _grid_step(grid: str) -> float:
    """The step of a grid that is given by name or by number."""
    if grid in _GRIDS:
        return _GRIDS[grid]
    try:
        return float(grid)
    except ValueError:
        raise InvalidInput(f"`--grid` must be thesis, fine or a number; got {grid}") from None


def _sweep_table(results: DirectionSweep) -> Table:
    table = Table(
        title=escape("Travel time [s]"),
        caption=escape("\n".join(results.remarks)),
        caption_justify="left",
        box=SIMPLE_HEAD,
    )
    for heading in ("ratio", *results.times, "lower bound"):
        table.add_column(heading, justify="right")
    for k, ratio in enumerate(results.ratios.tolist()):
        times = [_time_words(float(times[k])) for times in results.times.values()]
        table.add_row(f"{ratio:.2f}", *times, f"{results.lower_bounds[k]:.4f}")
    return table


def _time_words(time: float) -> str:
    return "-" if math.isnan(time) else f"{time:.4f}"


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

"""`sightfield schedule`: can these carts serve these combines, and what is the plan?"""

import csv
import math
from pathlib import Path
from typing import Annotated

import typer

from ...systems.numerics.errors import InvalidInput, require, require_positive
from ...systems.numerics.harvest.schedule.answer import answer_schedule, drawn_timetable
from ...systems.numerics.harvest.schedule.fleet import Fleet, Truck, line_of, require_count
from ...systems.numerics.units import read_quantities, read_quantity
from ..outputs import optional_folder, write_json
from ..schedule.schedule_table import schedule_tables
from ..schedule.summary import summarise_schedule
from .shared import JsonOption, tell

# More take splits and programmes of a size that nobody waits for.
_MOST_COMBINES = _MOST_CARTS = 20
_MOST_CYCLES = 1000
_EACH = "one, or one for each combine with commas between"


def schedule(
    combines: Annotated[int, typer.Option(help="How many combines there are.")],
    capacity: Annotated[str, typer.Option(help=f"Of a combine's tank [kg], as 9 t: {_EACH}.")],
    fill_rate: Annotated[
        str, typer.Option(help=f"Grain that a combine cuts [kg/s], as 70 t/h: {_EACH}.")
    ],
    unload_rate: Annotated[str, typer.Option(help=f"Of a combine's auger [kg/s]: {_EACH}.")],
    travel_time: Annotated[
        str | None,
        typer.Option(help="Of a cart between neighbours [s]: one number, or one for each gap."),
    ] = None,
    travel_times: Annotated[
        Path | None,
        typer.Option(help="Instead: a CSV file, from combine (row) to combine (column) [s]."),
    ] = None,
    carts: Annotated[int, typer.Option(help="How many grain carts there are.")] = 1,
    cart_capacity: Annotated[
        str | None, typer.Option(help="Of a cart, which then drives by a truck [kg].")
    ] = None,
    truck_travel_time: Annotated[
        str | None,
        typer.Option(
            help="One way between a combine and the truck [s] [default: half the longest way]."
        ),
    ] = None,
    truck_unload_rate: Annotated[
        str | None, typer.Option(help="From cart to truck [kg/s] [default: at once].")
    ] = None,
    truck_stop_time: Annotated[
        str | None, typer.Option(help="Spent at the truck besides unloading [s].")
    ] = None,
    fill: Annotated[
        float, typer.Option(help="Part of each tank that the plan uses, up to 1.")
    ] = 1.0,
    jitter: Annotated[
        float | None,
        typer.Option(help="Plan so that each time may be longer by this part, say 0.1."),
    ] = None,
    cycles: Annotated[int, typer.Option(help="Rounds in the load diagram.")] = 2,
    out: Annotated[
        Path | None, typer.Option(help="Folder to leave loads.png and summary.json in.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Serve combines in turn so that all keep cutting and no tank runs over.

    Combines are numbered from 0 in the order of their rows. Quantities may have units, as 9 t,
    300 bu wheat, 70 t/h, 1.5 min; without one they are in kg and s. If none has one, any unit of
    amount does in place of the kilogram.

    Exit code 0: there is a schedule; 1: there is none, with the reasons; 2: bad input.
    """
    require_count("combines", combines)
    require(combines <= _MOST_COMBINES, "combines", f"be at most {_MOST_COMBINES}", combines)
    require_count("carts", carts)
    require(carts <= _MOST_CARTS, "carts", f"be at most {_MOST_CARTS}", carts)
    require_count("cycles", cycles)
    require(cycles <= _MOST_CYCLES, "cycles", f"be at most {_MOST_CYCLES}", cycles)
    ways, gap = _ways(combines, travel_time, travel_times)
    fleet = Fleet(
        capacities=_each("capacity", capacity, "kg", combines),
        fill_rates=_each("fill_rate", fill_rate, "kg/s", combines),
        unload_rates=_each("unload_rate", unload_rate, "kg/s", combines),
        travel_times=ways,
    )
    # The nearest place that is equally far from all combines.
    middle = max(max(row) for row in ways) / 2
    truck = _truck(
        _one("cart_capacity", cart_capacity, "kg"),
        _one("truck_travel_time", truck_travel_time, "s"),
        _one("truck_unload_rate", truck_unload_rate, "kg/s"),
        _one("truck_stop_time", truck_stop_time, "s"),
        middle,
    )
    answer = answer_schedule(fleet, carts, truck, fill, jitter)
    summary = summarise_schedule(answer, carts, gap, fill, jitter)
    with optional_folder(out) as folder:
        if folder is not None:
            write_json(folder / "summary.json", summary)
            # Matplotlib takes its time to import.
            from ..schedule.load_diagram import save_load_diagram

            save_load_diagram(folder / "loads.png", answer, drawn_timetable(answer, cycles))
    written = ("summary.json", "loads.png")
    tell(summary, schedule_tables(summary), as_json=as_json, written=written, out=out)
    if not answer.feasible:
        raise typer.Exit(1)


def _ways(
    combines: int, travel_time: str | None, travel_times: Path | None
) -> tuple[tuple[tuple[float, ...], ...], float | None]:
    """Travel times from each combine to each, and the one between neighbours if it is one."""
    if travel_times is not None:
        require(travel_time is None, "travel_time", "be left out with travel_times", "both")
        return _matrix(travel_times, combines), None
    if travel_time is None:
        # A lone combine has no neighbour.
        require(combines == 1, "travel_time", "be given, or travel_times in a file", "neither")
        return line_of(()), None
    numbers = read_quantities("travel_time", travel_time, "s")
    if len(numbers) == 1:
        return line_of(numbers * (combines - 1)), _not_negative(numbers[0])
    what = f"be one number or {combines - 1}, one for each gap"
    require(len(numbers) == combines - 1, "travel_time", what, travel_time)
    return line_of(numbers), None


def _not_negative(travel_time: float) -> float:
    require(
        math.isfinite(travel_time) and travel_time >= 0,
        "travel_time",
        "be zero or positive",
        travel_time,
    )
    return travel_time


def _matrix(path: Path, combines: int) -> tuple[tuple[float, ...], ...]:
    """The rows of a CSV file."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput(
            f"`travel_times` must be a readable file; got {path} ({error})"
        ) from None
    lines = [line for line in csv.reader(text.splitlines()) if line]
    require(len(lines) == combines, "travel_times", f"have {combines} rows", len(lines))
    return tuple(
        read_quantities(f"travel_times.{row}", ",".join(line), "s")
        for row, line in enumerate(lines)
    )


def _each(name: str, text: str, unit: str, combines: int) -> tuple[float, ...]:
    """One number for each combine."""
    numbers = read_quantities(name, text, unit)
    if len(numbers) == 1:
        return numbers * combines
    what = f"be one number or {combines}, one for each combine"
    require(len(numbers) == combines, name, what, text)
    return numbers


def _one(name: str, text: str | None, unit: str) -> float | None:
    return None if text is None else read_quantity(name, text, unit)


def _truck(
    cart_capacity: float | None,
    travel_time: float | None,
    unload_rate: float | None,
    stop_time: float | None,
    middle: float,
) -> Truck | None:
    """The truck, if carts are of finite capacity; where nobody says, it is `middle` away [s]."""
    if cart_capacity is None:
        of_truck = {
            "truck_travel_time": travel_time,
            "truck_unload_rate": unload_rate,
            "truck_stop_time": stop_time,
        }
        for name, value in of_truck.items():
            require(value is None, name, "be left out without a cart_capacity", value)
        return None
    if unload_rate is not None:
        require_positive("truck_unload_rate", unload_rate)
    return Truck(
        cart_capacity=cart_capacity,
        travel_time=middle if travel_time is None else travel_time,
        unload_rate=math.inf if unload_rate is None else unload_rate,
        stop_time=stop_time or 0.0,
    )

"""`sightfield harvest plan`: what a harvest would take, and what other fleets would."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from ...systems.numerics.errors import InvalidInput, NoPlan
from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.fleets.figures import FleetFigures
from ...systems.numerics.units import area_text
from ..harvest import scenarios
from ..harvest.fleet_size import MOST, WhatItTakes, as_object, find_what_it_takes
from ..outputs import optional_folder, write_json
from ..scenario_files import builtin_scenarios
from .harvest_run import (
    CartsOption,
    CombinesOption,
    CoordinatesOption,
    FieldOption,
    PartOption,
    SettingOption,
    YieldsOption,
    asked_scenario,
)
from .shared import progress_bar, tell

# No table has more fleets than that.
LARGEST = 20
_HOUR, _KM = 3600.0, 1000.0


def plan(
    scenario: Annotated[
        str,
        typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios(scenarios))}."),
    ] = "thesis_2",
    field: FieldOption = None,
    coordinates: CoordinatesOption = None,
    part: PartOption = None,
    crop: Annotated[
        str | None, typer.Option("--yield", help='Grain on the field, as "8 t/ha" [kg/m^2].')
    ] = None,
    yields: YieldsOption = None,
    combines: CombinesOption = None,
    carts: CartsOption = None,
    setting: SettingOption = None,
    most: Annotated[
        str,
        typer.Option(
            metavar="N,K,M", help="Combines, carts and trucks of the largest fleet in the table."
        ),
    ] = ",".join(map(str, MOST)),
    table: Annotated[bool, typer.Option(help="Whether to look at other fleets at all.")] = True,
    out: Annotated[
        Path | None, typer.Option(help="Folder to leave fleets.png and fleets.json in.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object and nothing else.")
    ] = False,
) -> None:
    """Plan a harvest, and say what it takes: time, engine hours, way, fuel, waiting.

    The fleet of the scenario is planned in full. For fleets of other sizes the combines are
    planned, and the carts are those of a model; the table marks the knee, from which on a further
    machine saves less than machines did on the mean before.

    Exit code 0: there is a plan; 1: there is none, with the reason; 2: bad input.
    """
    largest = _largest(most) if table else None
    asked, folder = asked_scenario(
        scenario,
        setting or [],
        field,
        coordinates,
        part,
        combines=combines,
        carts=carts,
        density=crop,
        yields=yields,
    )
    name = Path(scenario).stem if field is None else f"{Path(scenario).stem} on {field.stem}"
    console = Console(stderr=as_json)
    with optional_folder(out) as written_to:
        with progress_bar(console, not as_json) as bar:
            task = bar.add_task("plan", total=1.0)

            def progress(stage: str, share: float) -> None:
                bar.update(task, description=stage, completed=share)

            try:
                answer = find_what_it_takes(asked, folder, largest, progress)
            except NoPlan as error:
                bar.stop()
                print(f"no plan: {error}", file=sys.stderr)
                raise typer.Exit(1) from None
        found = as_object(answer, name)
        if written_to is not None:
            write_json(written_to / "fleets.json", found)
            if answer.table is not None:
                # Matplotlib takes its time to import.
                from ..harvest.fleet_size import draw_fleets

                title = f"{name}, {area_text(answer.field.area)}, {10 * answer.density:.3g} t/ha"
                picture = draw_fleets(answer.table, title, answer.field.area)
                picture.savefig(written_to / "fleets.png", dpi=120)
    written = ["fleets.json", *(["fleets.png"] if answer.table is not None else [])]
    tell(found, *_shown(answer, found), as_json=as_json, written=written, out=out)


def _largest(text: str) -> tuple[int, int, int]:
    words = text.split(",")
    try:
        numbers = [int(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 3 or not all(1 <= number <= LARGEST for number in numbers):
        what = f"be three whole numbers from 1 to {LARGEST}, as {','.join(map(str, MOST))}"
        raise InvalidInput(f"`most` must {what}; got {text}")
    return numbers[0], numbers[1], numbers[2]


def _shown(answer: WhatItTakes, found: dict[str, object]) -> Iterator[RenderableType]:
    area, figures = answer.field.area, answer.figures
    lines = Table(show_header=False, box=None, padding=(0, 2))
    for what, value in _lines(figures, answer.field).items():
        lines.add_row(what, value)
    if answer.yields_known is not None:
        lines.add_row("yields are known of", f"{answer.yields_known:.1%} of the field")
    yield lines
    if answer.table is None:
        return
    rows = Table(box=SIMPLE_HEAD, title="Fleets: combines as planned, carts by the model")
    heads = ("combines", "carts", "trucks", "hours", "engine h", "km", "l/ha", "stands full", "")
    for head in heads:
        rows.add_column(head, justify="right")
    for number, row in enumerate(answer.table.rows):
        rows.add_row(
            str(row.combines),
            str(row.carts),
            str(row.trucks) if _counts_trucks(answer) else "any",
            f"{row.makespan / _HOUR:.2f}",
            f"{row.engine_hours:.1f}",
            f"{(row.combine_way + row.cart_way) / _KM:.1f}",
            f"{row.fuel / (area / 1e4):.1f}",
            f"{row.combines_for_carts / row.combine_engine_time:.1%}",
            "knee" if number == answer.table.knee else "",
        )
    yield rows
    if isinstance(found.get("model_over_plan"), float):
        ratio = f"{found['model_over_plan']:.3f}"
        yield f"The model's time for the fleet above is {ratio} of the plan's."
    if not _counts_trucks(answer):
        yield "Trucks hold any amount: set trucks.capacity and trucks.road_time."
    for combines, carts, reason in answer.table.refused:
        who = f"{combines} combines" + (f" with {carts} carts" if carts else "")
        yield Text(f"No plan for {who}: {reason}.")


def _counts_trucks(answer: WhatItTakes) -> bool:
    return answer.scenario.trucks.capacity < float("inf")


def _lines(figures: FleetFigures, field: Field) -> dict[str, str]:
    """What is told of the fleet that is planned in full."""
    return {
        "fleet": f"{figures.combines} combines, {figures.carts} carts",
        "field": area_text(field.area),
        "margin outside of it": f"{field.margin:g} m, to turn and to drive on",
        "makespan": f"{figures.makespan / _HOUR:.2f} h",
        "engine hours of combines": f"{figures.combine_engine_time / _HOUR:.2f} h",
        "engine hours of carts": f"{figures.cart_engine_time / _HOUR:.2f} h",
        "way of combines": f"{figures.combine_way / _KM:.1f} km",
        "way of carts": f"{figures.cart_way / _KM:.1f} km",
        "fuel of combines": f"{figures.combine_fuel:.0f} l",
        "fuel of carts": f"{figures.cart_fuel:.0f} l",
        "fuel": f"{figures.fuel / (field.area / 1e4):.1f} l/ha",
        "combines stand full": f"{figures.combines_for_carts:.0f} s, {figures.misses} times",
        "combines wait for combines": f"{figures.combines_for_combines:.0f} s",
        "carts wait for grain": f"{figures.carts_for_grain / 60:.0f} min",
        "carts wait for trucks": f"{figures.carts_for_trucks / 60:.0f} min",
        "visits, trips": f"{figures.visits}, {figures.trips}",
    }

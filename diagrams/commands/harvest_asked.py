"""What commands of a harvest are asked for: a scenario, with a field and values of one's own."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ..harvest import scenarios
from ..harvest.makers import settings_of_machines
from ..harvest.scenario import HarvestScenario
from ..scenario_files import find_scenario, load_scenario
from .shared import with_options

FieldOption = Annotated[
    Path | None,
    typer.Option(help="Harvest this field: WKT, GeoJSON, Shapefile or ISOXML task data."),
]
CoordinatesOption = Annotated[
    str | None,
    typer.Option(help="Of the field's file: wgs84, in degrees [default], or metres."),
]
PartOption = Annotated[
    int | None, typer.Option(help="Of a file with several parts: which one, from 1.")
]
YieldsOption = Annotated[
    Path | None,
    typer.Option(help="What grows where: GeoJSON or an ESRI ASCII grid [t/ha]."),
]
CombinesOption = Annotated[int | None, typer.Option(help="Number of combines.")]
CartsOption = Annotated[int | None, typer.Option(help="Number of carts.")]
SettingOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Set a key, as carts.speed=4 or "carts.speed=15 km/h".',
    ),
]


def asked_scenario(
    scenario: str,
    settings: Sequence[str],
    field: Path | None = None,
    coordinates: str | None = None,
    part: int | None = None,
    *,
    combines: int | None = None,
    carts: int | None = None,
    strategy: str | None = None,
    density: str | None = None,
    yields: Path | None = None,
) -> tuple[HarvestScenario, Path]:
    """A scenario as options change it, and the folder that files are looked for in.

    Args:
        scenario: Name of a built-in one, or a file.
        settings: `key=value`, of the scenario.
        field, coordinates, part: See `FieldOption`, `CoordinatesOption` and `PartOption`.
        combines, carts: How many.
        strategy: Of the visits.
        density: Of the crop, with a unit or in [kg/m^2].
        yields: See `YieldsOption`.

    Raises:
        InvalidInput: A file or a key is not there, or a value is out of its range.
    """
    # Before what is set, so that a machine may be named and changed.
    named = [*settings_of_machines(settings), *settings]
    options = {
        "combines.count": combines,
        "carts.count": carts,
        "field.coordinates": coordinates,
        "strategy": strategy,
        "density": density,
    }
    every = with_options(named, options)
    path = find_scenario(scenario, scenarios)
    folder = path.parent
    if field is not None:
        # Before what is set, so that a part or a no-go layer may be set for it.
        every.insert(0, "field.file=" + json.dumps(str(field)))
        folder = Path()
    if yields is not None:
        every.insert(0, "yields.file=" + json.dumps(str(yields.resolve())))
    if part is not None:
        every.append(f"field.part={part}")
    return load_scenario(HarvestScenario, path, every), folder

"""What commands of a harvest are asked for: a scenario, with a field and values of one's own."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ..harvest import scenarios
from ..harvest.makers import settings_of_machines
from ..harvest.scenario import HarvestScenario
from ..scenario_files import build, find_scenario, read_tree, refuse_doubled, with_settings
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
    options = {
        "--field": ("field.file", None if field is None else json.dumps(str(field))),
        "--coordinates": ("field.coordinates", coordinates),
        "--part": ("field.part", part),
        "--combines": ("combines.count", combines),
        "--carts": ("carts.count", carts),
        "--strategy": ("strategy", strategy),
        "--yield": ("density", density),
        "--yields": ("yields.file", None if yields is None else json.dumps(str(yields.resolve()))),
    }
    every = with_options(settings, options)
    # Before the figures of machines, whose keys nobody said.
    refuse_doubled(every)
    path = find_scenario(scenario, scenarios)
    # What a machine has is not set by anybody: it may be named, and then changed.
    tree = with_settings(read_tree(path), settings_of_machines(settings))
    folder = path.parent if field is None else Path()
    return build(HarvestScenario, with_settings(tree, every)), folder

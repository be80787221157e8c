"""`sightfield world`: what is in a world file."""

from pathlib import Path
from typing import Annotated

import typer

from ...systems.numerics.geometry.occupancy_outline import OutlineOptions
from ...systems.numerics.geometry.world_files import LoadedWorld, load_world
from ..outputs import optional_folder, write_json
from ..world_picture import save_world_picture
from .shared import JsonOption, summary_table, tell

DEFAULTS = OutlineOptions()

# Unit and meaning of each entry of a summary.
ROWS = {
    "source": ("", "what the file is"),
    "obstacles": ("", "holes in the free region"),
    "vertices": ("", "of all outlines"),
    "corners": ("", "reflex vertices, behind which something can hide"),
    "free_area": ("m^2", "area of the free region"),
    "simplification_error": ("m", "Hausdorff distance to the outlines in the file"),
    "speckle_area": ("m^2", "area of small obstacles that were dropped"),
    "unreachable_area": ("m^2", "free in the file, but cut off"),
    "bounds": ("m", "x_min, y_min, x_max, y_max"),
    "geographic_origin": ("deg", "longitude and latitude of x = y = 0"),
}


def world(
    file: Annotated[
        Path,
        typer.Argument(help="WKT (.wkt), GeoJSON (.geojson, .json) or ROS map (.yaml, .yml)."),
    ],
    json_: JsonOption = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to leave world.png and summary.json in."),
    ] = None,
    unknown: Annotated[
        str, typer.Option(help="ROS maps: unknown cells count as `occupied` or `free`.")
    ] = DEFAULTS.unknown,
    speckle: Annotated[
        float,
        typer.Option(help="ROS maps: drop obstacles smaller than this, walls excepted [m^2]."),
    ] = DEFAULTS.min_obstacle_area,
    wall: Annotated[
        float,
        typer.Option(help="ROS maps: a slender obstacle at least this long is a wall [m]."),
    ] = DEFAULTS.min_wall_length,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="ROS maps: how far outlines may be from the cells' [m].",
            show_default="side of a cell",
        ),
    ] = DEFAULTS.tolerance,
    wgs84: Annotated[
        bool,
        typer.Option(
            "--wgs84",
            help="WKT, GeoJSON: coordinates are longitude and latitude [deg], "
            "made into metres east and north of the boundary's centroid.",
        ),
    ] = False,
) -> None:
    """Load a world from a file, report what is in it, and draw it."""
    options = OutlineOptions(
        unknown=unknown, min_obstacle_area=speckle, min_wall_length=wall, tolerance=tolerance
    )
    loaded = load_world(file, options=options, coordinates="wgs84" if wgs84 else "metres")
    summary = summarise(loaded)
    with optional_folder(out) as folder:
        if folder is not None:
            write_json(folder / "summary.json", summary)
            save_world_picture(folder / "world.png", loaded.world, file.name)
    table = summary_table(file.name, summary, ROWS, digits=6)
    written = ("summary.json", "world.png")
    tell(summary, table, as_json=json_, written=written, out=out)


def summarise(loaded: LoadedWorld) -> dict[str, object]:
    """The entries of a world's summary, ready for JSON; see ROWS for units and meanings."""
    world = loaded.world
    origin = loaded.geographic_origin
    return {
        "source": loaded.source,
        "obstacles": len(world.obstacles),
        "vertices": world.vertex_count,
        "corners": len(world.corners),
        "free_area": world.free_area,
        "simplification_error": loaded.simplification_error,
        "speckle_area": loaded.speckle_area,
        "unreachable_area": loaded.unreachable_area,
        "bounds": world.bounds.tolist(),
        "geographic_origin": None if origin is None else list(origin),
    }

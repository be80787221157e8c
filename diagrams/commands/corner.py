"""`sightfield corner`: who wins round one corner, and a picture of it."""

import math
from pathlib import Path
from typing import Annotated

import typer

from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.tracking.corner_game import (
    HIDDEN,
    REGION_1,
    REGION_NAMES,
    escape_time,
    margins,
    to_corner_frame,
)
from ...systems.numerics.tracking.corner_policies import FIELDS, field_grid, partition, require_near
from ..outputs import optional_folder, write_json
from ..tracking.corner_picture import save_corner_picture
from .shared import JsonOption, summary_table, tell

# Unit and meaning of each entry of a summary.
ROWS = {
    "alpha": ("rad", "interior angle of the obstacle"),
    "ratio": ("", "evader's speed over the pursuer's"),
    "pursuer": ("m", "position"),
    "evader": ("m", "position"),
    "region": ("", "of Table 2.1"),
    "winner": ("", "if both play as well as they can"),
    "escape_time": ("s", "until sight is lost, if it is"),
    "star_distance": ("m", "D_p, from the pursuer to the star region"),
    "edge_distance": ("m", "D_e, from the evader to the far edge"),
    "margin": ("m", "D_e - ratio D_p, negative: the evader wins"),
    "field": ("", "pursuit field"),
    "direction": ("", "of the field at the pursuer"),
}


def corner(
    alpha: Annotated[
        float, typer.Option(help="Interior angle of the obstacle, between 0 and pi [rad].")
    ] = math.pi / 2,
    ratio: Annotated[
        float, typer.Option(help="Evader's top speed over the pursuer's, between 0 and 1.")
    ] = 0.5,
    pursuer: Annotated[
        tuple[float, float],
        typer.Option(metavar="X Y", help="Pursuer's position in the corner's frame [m]."),
    ] = (1.0, -1.5),
    evader: Annotated[
        tuple[float, float],
        typer.Option(metavar="X Y", help="Evader's position in the corner's frame [m]."),
    ] = (-0.2, 0.6),
    speed: Annotated[float, typer.Option(help="Pursuer's top speed [m/s].")] = 1.0,
    field: Annotated[str, typer.Option(help=f"One of {', '.join(FIELDS)}.")] = "margin",
    out: Annotated[
        Path | None, typer.Option(help="Folder to leave corner.png and summary.json in.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """One pursuer, one evader, one corner: who wins, and what each should do.

    The corner is the origin. One edge of the obstacle lies along the negative x axis, the other
    alpha further counter-clockwise.
    """
    summary = summarise(alpha, ratio, pursuer, evader, speed, field)
    with optional_folder(out) as folder:
        if folder is not None:
            write_json(folder / "summary.json", summary)
            save_corner_picture(folder / "corner.png", alpha, ratio, pursuer, evader, field)
    written = ("summary.json", "corner.png")
    tell(summary, summary_table("Corner", summary, ROWS), as_json=as_json, written=written, out=out)


def summarise(
    alpha: float,
    ratio: float,
    pursuer: tuple[float, float],
    evader: tuple[float, float],
    speed: float,
    field: str,
) -> dict[str, object]:
    """The entries of a corner's summary, ready for JSON; see ROWS for units and meanings.

    Raises:
        InvalidInput: An argument is out of range, or a player is inside the obstacle.
    """
    require_positive("speed", speed)
    # Checked below too, but under the name that formulas give it.
    require(0 < ratio < 1, "ratio", "lie strictly between 0 and 1", ratio)
    for name, position in (("pursuer", pursuer), ("evader", evader)):
        require_near(name, position)
    # The array functions check what the kernels take for granted.
    code = int(partition(pursuer, evader, alpha, ratio))
    ux, uy, _ = field_grid(field, evader, pursuer, alpha, ratio).tolist()
    r_p, phi_p, r_e, phi_e, _ = to_corner_frame(*pursuer, *evader, 0.0, 0.0, 0.0, alpha)
    margin, _, star_distance, edge_distance, _ = margins(r_p, phi_p, r_e, phi_e, alpha, ratio)
    time = escape_time(r_p, phi_p, r_e, phi_e, alpha, ratio, speed)
    return {
        "alpha": alpha,
        "ratio": ratio,
        "pursuer": list(pursuer),
        "evader": list(evader),
        "region": REGION_NAMES[code],
        "winner": "evader" if code in (HIDDEN, REGION_1) else "pursuer",
        "escape_time": time if math.isfinite(time) else None,
        "star_distance": star_distance,
        "edge_distance": edge_distance,
        "margin": margin,
        "field": field,
        "direction": [ux, uy],
    }

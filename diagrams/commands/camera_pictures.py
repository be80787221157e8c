"""`sightfield camera render`, `estimate` and `convert`: pictures, what is in them, their camera."""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import shapely
import typer
from rich.markup import escape
from rich.table import Table

from ...systems.numerics.errors import InvalidInput, require
from ...systems.numerics.geometry.world import make_world
from ...systems.numerics.geometry.world_files import load_world
from ...systems.numerics.vision.camera_models.camera_files import (
    FORMS,
    load_camera_model,
    save_camera_model,
)
from ...systems.numerics.vision.estimation.calibration import THESIS_DISTANCES, load_calibration
from ...systems.numerics.vision.estimation.labelled_pictures import (
    TABLE,
    save_pictures,
    simulated_pictures,
)
from ...systems.numerics.vision.estimation.pictures import (
    load_picture,
    require_contrast,
    save_picture,
)
from ...systems.numerics.vision.estimation.range_models import MODELS
from ...systems.numerics.vision.estimation.shell_detection import chosen_colours
from ...systems.numerics.vision.estimation.shell_estimate import search_shells
from ...systems.numerics.vision.omni_optics import make_ray_table
from ...systems.numerics.vision.rendering import render as render_light
from ...systems.numerics.vision.sensor import Sensor, expose
from ...systems.numerics.vision.surroundings import SHELL_COLOURS, Shell, Surroundings, shell_of
from ..outputs import optional_folder, output_folder, write_json
from ..vision.calibration import load_camera, save_found_picture, summarise_found
from .shared import JsonOption, given_options, refuse_unused, tell

SHELL, QUALITY = Shell(), Sensor()
COLOUR_HELP = f"One of {', '.join(SHELL_COLOURS)}"
CameraOption = Annotated[
    Path | None,
    typer.Option("--camera", help="YAML file of the optics [default: the simulated robot's]."),
]
BaseOption = Annotated[float, typer.Option(help="Height of a shell's bottom edge [m].")]
TopOption = Annotated[float, typer.Option(help="Height of a shell's top edge [m].")]
RadiusOption = Annotated[float, typer.Option(help="Of a shell [m].")]
NoiseOption = Annotated[float, typer.Option(help="Of the sensor, in counts of 255.")]
BlurOption = Annotated[float, typer.Option(help="Of lens and mirror, in pixels.")]
ExposureOption = Annotated[float, typer.Option(help="1: white light is 255.")]
SeedOption = Annotated[int, typer.Option(help="Of the noise.")]
PoseOption = Annotated[
    tuple[float, float, float],
    typer.Option(metavar="X Y THETA", help="Of the camera [m], [m], [rad]."),
]


# Pictures of a calibration have places and walls of their own.
BESIDE_PRACTICE = ("pose", "world", "wall_height")


def render(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for picture.png, or a calibration's pictures.")],
    shell: Annotated[
        list[str] | None,
        typer.Option(metavar="COLOUR:X:Y", help=f"A shell; again for more. {COLOUR_HELP}; [m]."),
    ] = None,
    pose: PoseOption = (0.0, 0.0, 0.0),
    world: Annotated[
        Path | None, typer.Option(help="Walls: WKT, GeoJSON or ROS map [default: a room].")
    ] = None,
    wall_height: Annotated[float, typer.Option(help="[m].")] = 0.5,
    practice: Annotated[
        bool,
        typer.Option(
            "--practice", help="All pictures of a calibration instead, of the first shell's colour."
        ),
    ] = False,
    directions: Annotated[int, typer.Option(help="Of --practice, at each distance.")] = 8,
    camera: CameraOption = None,
    base: BaseOption = SHELL.base,
    top: TopOption = SHELL.top,
    radius: RadiusOption = SHELL.radius,
    noise: NoiseOption = QUALITY.noise,
    blur: BlurOption = QUALITY.blur,
    exposure: ExposureOption = QUALITY.exposure,
    seed: SeedOption = 0,
    as_json: JsonOption = False,
) -> None:
    """Take a picture with the simulated camera, or the pictures of a calibration (15-60 inches)."""
    given, own = given_options(context), {"practice": BESIDE_PRACTICE}
    refuse_unused(given, beside=own, without={"practice": ["directions"]})
    optics = load_camera(camera)
    sensor = Sensor(noise=noise, blur=blur, exposure=exposure, seed=seed)
    words = shell or ["red:0.8:0"]
    asked = [_parsed_shell(each) for each in words]
    shells = [shell_of(each, radius=radius, base=base, top=top) for each, _ in asked]
    places = np.array([place for _, place in asked])
    with output_folder(out) as folder:
        if practice:
            taken = simulated_pictures(
                optics, sensor, shells[0], distances=THESIS_DISTANCES, directions=directions
            )
            count = save_pictures(folder, taken)
            summary: dict[str, object] = {"pictures": count, "table": TABLE}
        else:
            away = places - pose[:2]
            for text, far in zip(words, away, strict=True):
                clear = math.hypot(*far) - radius > optics.mirror_radius
                require(clear, "--shell", "stand clear of the camera and its mirror", text)
            for k, (text, place) in enumerate(zip(words, places, strict=True)):
                apart = np.hypot(*(places[:k] - place).T) >= 2 * radius
                require(bool(apart.all()), "--shell", "stand clear of the other shells", text)
            scene = _scene(world, pose, places, wall_height)
            light = render_light(optics, make_ray_table(optics), scene, pose, shells, places)
            save_picture(folder / "picture.png", expose(sensor, light, 0))
            turns = np.arctan2(away[:, 1], away[:, 0]) - pose[2]
            summary = {
                "picture": "picture.png",
                "pose": list(pose),
                "shells": [
                    {
                        "colour": name,
                        "position": list(place),
                        "range": float(math.hypot(*far) - radius),
                        "bearing": math.remainder(float(turn), 2 * math.pi),
                    }
                    for (name, place), far, turn in zip(asked, away, turns, strict=True)
                ],
            }
        write_json(folder / "summary.json", summary)
    written = ("summary.json", "pictures" if practice else "picture.png")
    tell(summary, as_json=as_json, written=written, out=out)


def _parsed_shell(text: str) -> tuple[str, tuple[float, float]]:
    """Colour and position of a shell, from COLOUR:X:Y."""
    colour, *numbers = text.split(":")
    try:
        x, y = (float(each) for each in numbers)
    except ValueError:
        raise InvalidInput(f"`--shell` must have the form COLOUR:X:Y; got {text}") from None
    require(math.isfinite(x) and math.isfinite(y), "--shell", "have a finite place", text)
    return colour, (x, y)


def _scene(
    world: Path | None,
    pose: tuple[float, float, float],
    places: np.ndarray,
    wall_height: float,
) -> Surroundings:
    """A world's walls, or a room 2 m larger than what is in it."""
    for value in pose:
        require(math.isfinite(value), "pose", "be finite", pose)
    if world is None:
        low, high = (f(np.vstack([places, pose[:2]]), axis=0) for f in (np.min, np.max))
        (west, south), (east, north) = (low - 2).tolist(), (high + 2).tolist()
        room = make_world([[west, south], [east, south], [east, north], [west, north]], [])
    else:
        room = load_world(world).world
        free = room.polygon.covers(shapely.Point(pose[:2]))
        require(free, "pose", "be in the free region of the world", pose[:2])
    return Surroundings(world=room, wall_height=wall_height)


def estimate(
    picture: Annotated[Path, typer.Argument(help="PNG or JPEG file.")],
    calibration: Annotated[Path, typer.Option(help="File of `sightfield camera calibrate`.")],
    colour: Annotated[
        list[str] | None,
        typer.Option(help=f"Look for this shell; again for more. {COLOUR_HELP} [default: red]."),
    ] = None,
    model: Annotated[str, typer.Option(help=f"Of ranges: {' or '.join(MODELS)}.")] = "exact",
    pose: PoseOption = (0.0, 0.0, 0.0),
    out: Annotated[
        Path | None, typer.Option(help="Folder for estimate.png and summary.json.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Say where the shells in a picture are, and how surely, or why there is no telling.

    Ranges are from the mirror's axis to a shell's near side; --json has the place of its axis too.

    Exit code 0: every shell that was asked for is found; 1: one is not; 2: bad input.
    """
    names = colour or ["red"]
    known, colours = load_calibration(calibration), chosen_colours(names)
    for value in pose:
        require(math.isfinite(value), "pose", "be finite", pose)
    pixels = load_picture(picture)
    require_contrast(pixels)
    pairs = search_shells(pixels, colours, known, model)
    found = [(name, *pair) for name, pair in zip(names, pairs, strict=True)]
    summary = summarise_found(found, known, pose, model)
    with optional_folder(out) as folder:
        if folder is not None:
            write_json(folder / "summary.json", summary)
            save_found_picture(folder / "estimate.png", pixels, found, known)
    table = Table("shell", "outcome", escape("range to near side [m]"), escape("bearing [rad]"))
    for name, _, each in found:
        spread = np.sqrt(np.diag(each.covariance))
        numbers = ["no estimate", ""]
        if each.outcome.has_estimate:
            numbers = [
                f"{each.range:.4f} ± {spread[0]:.4f}",
                f"{each.bearing:.4f} ± {spread[1]:.4f}",
            ]
        table.add_row(name, each.outcome.words, *numbers)
    written = ("summary.json", "estimate.png")
    tell(summary, table, as_json=as_json, written=written, out=out)
    if not all(each.outcome.has_estimate for _, _, each in found):
        raise typer.Exit(1)


def convert(
    source: Annotated[
        Path,
        typer.Argument(help="File of OCamCalib, OpenCV (omnidir, fisheye), Kalibr or Sightfield."),
    ],
    target: Annotated[Path, typer.Argument(help="File to write.")],
    form: Annotated[
        str, typer.Option("--format", help=f"Of the file to write: {', '.join(FORMS)}.")
    ] = "sightfield",
) -> None:
    """Read a camera from one program's file and write it as another's.

    A model is never changed for another: a form that has no place for it is refused.
    """
    camera = load_camera_model(source)
    save_camera_model(target, camera, form)
    typer.echo(f"Wrote {type(camera).__name__} to {target}")

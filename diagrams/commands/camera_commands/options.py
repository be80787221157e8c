"""Options that several commands of `sightfield camera` share."""

from pathlib import Path
from typing import Annotated

import typer

from ....systems.numerics.vision.sensor import Sensor
from ....systems.numerics.vision.shells import SHELL_COLOURS, Shell

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
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
PoseOption = Annotated[
    tuple[float, float, float],
    typer.Option(metavar="X Y THETA", help="Of the camera [m], [m], [rad]."),
]

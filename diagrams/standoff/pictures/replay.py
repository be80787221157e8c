"""A run of the stand-off loop as a page that plays back without a server or a network."""

import math
from pathlib import Path

import numpy as np
import shapely
from matplotlib.colors import to_rgb
from pydrake.geometry import Meshcat, MeshcatParams

from ...visuals.lighting import paint, set_lights
from ...visuals.meshes import bar_mesh, disc_mesh, extruded_mesh, flat_mesh
from ...visuals.replay import write_replay
from ...visuals.stage import Stage
from ...visuals.text import text_mesh
from ..run import StandoffRun
from .colours import EVADER, PURSUER

ROOT = "/standoff"
_PERIOD = 1 / 30
_ASPECT = 16 / 9
_PAPER, _INK = paint(0.985, 0.985, 0.985), paint(0.11, 0.13, 0.17)
# Colour of the estimate, and how far the camera leans back [rad].
_ESTIMATE = "#e08a00"
_TILT = 0.5


class StandoffScene:
    """Pursuer and evader on their line, and where the pursuer takes the evader to be.

    Attributes:
        meshcat: Where it is drawn.
    """

    def __init__(self, meshcat: Meshcat, run: StandoffRun, title: str) -> None:
        """Draw what stands still, and the robots.

        Args:
            meshcat: The page.
            run: What is played.
            title: Stands above it.
        """
        self.meshcat = meshcat
        self._run = run
        ends = np.concatenate([run.evader, run.pursuer, run.pursuer + run.estimate])
        low, high = float(ends.min()), float(ends.max())
        # The robots stay visible, and apart, at the run's last distance.
        self._width = max(high - low, 0.5) * 1.15
        middle = (low + high) / 2
        body = 0.012 * self._width
        self._stage = Stage(
            meshcat, ROOT, recording=True, period=_PERIOD, tolerance=5e-5 * self._width
        )
        self._set_camera(middle)
        self._draw_floor(middle, title)
        # The evader's near side is where the distance ends, and the pursuer's camera where it
        # begins: they are drawn on either side.
        for name, colour, shift in (("pursuer", PURSUER, -body), ("evader", EVADER, body)):
            shape = shapely.Point(shift, 0).buffer(body)
            mesh = extruded_mesh(shape, 0, 1.6 * body)
            self._stage.mesh(f"{name}/body", mesh, paint(*to_rgb(colour)))
        ring = paint(*to_rgb(_ESTIMATE))
        self._stage.mesh("estimate/ring", disc_mesh(1.7 * body, 1.3 * body), ring)
        self._stage.raise_to("estimate", 0.002 * self._width)
        self._body = body

    def play(self) -> None:
        """Move the robots as they moved, and record it."""
        run = self._run
        last = float(run.times[-1])
        for time in np.arange(0.0, last + _PERIOD / 2, _PERIOD).tolist():
            self._stage.begin(time)
            pursuer, evader, estimate = (
                float(np.interp(time, run.times, values))
                for values in (run.pursuer, run.evader, run.estimate)
            )
            self._stage.place("pursuer/body", pursuer, 0.0)
            self._stage.place("evader/body", evader, 0.0)
            self._stage.place("estimate/ring", pursuer + estimate + self._body, 0.0)

    def finish_recording(self) -> None:
        """End the recording with what was drawn last."""
        self._stage.finish_recording()

    def _draw_floor(self, middle: float, title: str) -> None:
        stage, width = self._stage, self._width
        floor = shapely.box(middle - width, -0.6 * width, middle + width, 0.6 * width)
        stage.mesh("floor", flat_mesh(floor, -0.002 * width), _PAPER)
        step = 10 ** math.floor(math.log10(width / 2))
        step *= 0.5 if width / step < 5 else 1 if width / step < 10 else 2
        first = math.ceil((middle - width / 2) / step)
        marks = step * np.arange(first, math.floor((middle + width / 2) / step) + 1)
        # Below the robots, a ruler.
        edge = np.full(len(marks), -0.06 * width)
        ticks = bar_mesh(
            np.column_stack([marks, edge]),
            np.column_stack([marks, edge + 0.012 * width]),
            0.001 * width,
        )
        stage.mesh("ruler/ticks", ticks, _INK)
        for mark in marks.tolist():
            name = f"ruler/{round(mark / step)}".replace("-", "minus")
            stage.mesh(name, text_mesh(f"{mark:g} m", 0.01 * width, align="centre"), _INK)
            stage.place(name, mark, -0.08 * width)
        left = middle - 0.48 * width
        words = (
            (title, _INK),
            ("pursuer", paint(*to_rgb(PURSUER))),
            ("evader", paint(*to_rgb(EVADER))),
            ("where the pursuer takes it to be", paint(*to_rgb(_ESTIMATE))),
        )
        for k, (line, colour) in enumerate(words):
            stage.mesh(f"words/{k}", text_mesh(line, 0.013 * width, bold=k == 0), colour)
            stage.place(f"words/{k}", left, (0.25 - 0.026 * k) * width)

    def _set_camera(self, middle: float) -> None:
        meshcat, width = self.meshcat, self._width
        half = width / 2
        meshcat.SetCamera(
            Meshcat.OrthographicCamera(
                left=-half,
                right=half,
                bottom=-half / _ASPECT,
                top=half / _ASPECT,
                near=0.01 * width,
                far=8 * width,
            )
        )
        centre = np.array([middle, 0.0, 0.0])
        eye = centre + 4.0 * width * np.array([0.0, -math.sin(_TILT), math.cos(_TILT)])
        # Drake's stubs put the dtype of an array where its shape belongs.
        meshcat.SetCameraPose(eye, centre)  # pyright: ignore[reportArgumentType]
        for part in ("/Grid", "/Axes"):
            meshcat.SetProperty(part, "visible", False)
        set_lights(meshcat)


def write_standoff_replay(path: Path, run: StandoffRun, title: str) -> Path:
    """Write a self-contained page that plays a run.

    Args:
        path: Of the page.
        run: What is played.
        title: Stands above it.

    Raises:
        OSError: The file cannot be written.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost", port=0, show_stats_plot=False))
    scene = StandoffScene(meshcat, run, title)
    scene.play()
    return write_replay(scene, path, title="Sightfield: stand-off")

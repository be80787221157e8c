"""What `sightfield standoff simulate` says of a run and leaves behind: numbers, plot and replay.

The replay is one page that plays back without a server or a network.
"""

import math
from pathlib import Path

import numpy as np
import shapely
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from pydrake.geometry import Meshcat, MeshcatParams

from ...systems.numerics.standoff.loop import wanted_equilibrium
from ..outputs import write_json
from ..visuals.lighting import paint, set_lights
from ..visuals.meshes import bar_mesh, disc_mesh, extruded_mesh, flat_mesh
from ..visuals.replay import write_replay
from ..visuals.stage import Stage
from ..visuals.text import Digits, text_mesh
from .make_standoff import StandoffRun, StandoffScenario
from .pictures import EVADER, PURSUER, REFERENCE, SINGULAR

_ESTIMATE = "#e08a00"


def draw_run(scenario: StandoffScenario, run: StandoffRun) -> Figure:
    """Distance and estimate above, command below.

    Args:
        scenario: What was simulated.
        run: Its samples.
    """
    figure = Figure(figsize=(10, 6), layout="constrained")
    distance, command = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1])
    rest, loop = wanted_equilibrium(scenario.loop).y, scenario.loop
    distance.plot(
        run.times, run.estimate, color=_ESTIMATE, lw=0.8, label="as the controller sees it"
    )
    distance.plot(run.times, run.distance, color=PURSUER, label="true distance y")
    distance.axhline(rest, color="black", lw=0.8, label=f"estimate = r: y = {rest:.4f} m")
    distance.axhline(
        loop.reference, color=REFERENCE, ls="--", lw=1, label=f"r = {loop.reference:g} m"
    )
    distance.set_ylabel("distance [m]")
    distance.legend(loc="best", framealpha=0.85)
    command.step(run.times, run.command, where="post", color=PURSUER, lw=0.9)
    if not math.isinf(scenario.sampled.limit):
        for sign in (-1, 1):
            command.axhline(sign * scenario.sampled.limit, color=SINGULAR, ls=":", lw=1)
    command.set_ylabel("command [m/s]")
    command.set_xlabel("time [s]")
    for axes in (distance, command):
        axes.grid(alpha=0.3)
    clock = scenario.sampled
    words = f"sampled by {1000 * clock.period:g} ms"
    if scenario.delay_samples:
        words += f", {1000 * clock.period * scenario.delay_samples:g} ms late"
    if scenario.noise:
        words += f", noise {1000 * scenario.noise:g} mm"
    figure.suptitle(f"{loop.controller}, {words}")
    return figure


def save_run_picture(path: Path, scenario: StandoffScenario, run: StandoffRun) -> None:
    """Write what `draw_run` draws as a PNG picture."""
    draw_run(scenario, run).savefig(path, dpi=110)


ROOT = "/standoff"
_PERIOD = 1 / 30
_ASPECT = 16 / 9
_PAPER, _INK = paint(0.985, 0.985, 0.985), paint(0.11, 0.13, 0.17)
_TILT = 0.5
# Part of the width that is still seen on a page that is nearly twice as high as wide: Meshcat keeps
# the height. All that matters lies within.
_NARROW = 0.27
# Radius of a robot, as a part of the width.
_BODY = 0.012
# How far away the camera is, in widths.
_AFAR = 8.0
# No more labels on a ruler than this.
_MOST_LABELS = 200


class StandoffScene:
    """Pursuer and evader on their line, and where the pursuer takes the evader to be.

    The page goes with them: the middle between the two stays in its middle, and the ruler moves.

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
        middle = (run.evader + run.pursuer) / 2
        ends = np.stack([run.evader, run.pursuer, run.pursuer + run.estimate]) - middle
        # The robots stay apart at the run's last distance.
        self._width = max(2.2 * float(np.abs(ends).max()) / (_NARROW - 4 * _BODY), 0.5)
        body = _BODY * self._width
        self._stage = Stage(
            meshcat, ROOT, recording=True, period=_PERIOD, tolerance=5e-5 * self._width
        )
        self._set_camera(0.0)
        self._draw_floor()
        self._draw_ruler(float(middle.min()), float(middle.max()))
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
        self._numbers = self._draw_words(title)

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
            middle = (pursuer + evader) / 2
            self._stage.place("ruler", -middle, 0.0)
            self._stage.place("pursuer/body", pursuer - middle, 0.0)
            self._stage.place("evader/body", evader - middle, 0.0)
            self._stage.place("estimate/ring", pursuer + estimate - middle + self._body, 0.0)
            for number, value in zip(self._numbers, (evader - pursuer, estimate), strict=True):
                number.show(abs(value))

    def finish_recording(self) -> None:
        """End the recording with what was drawn last."""
        self._stage.finish_recording()

    def _draw_floor(self) -> None:
        stage, width = self._stage, self._width
        floor = shapely.box(-width, -0.6 * width, width, 0.6 * width)
        stage.mesh("floor", flat_mesh(floor, -0.002 * width), _PAPER)

    def _draw_ruler(self, low: float, high: float) -> None:
        """Ticks and labels below the robots, for middles between `low` and `high` [m]."""
        stage, width = self._stage, self._width
        part = _NARROW * width
        step = 10 ** math.floor(math.log10(part / 2))
        step *= 0.5 if part / step < 5 else 1 if part / step < 10 else 2
        step *= max(1, math.ceil((high - low + width) / step / _MOST_LABELS))
        first = math.ceil((low - width / 2) / step)
        marks = step * np.arange(first, math.floor((high + width / 2) / step) + 1)
        edge = np.full(len(marks), -0.06 * width)
        ticks = bar_mesh(
            np.column_stack([marks, edge]),
            np.column_stack([marks, edge + 0.012 * width]),
            0.001 * width,
        )
        stage.mesh("ruler/ticks", ticks, _INK)
        for mark in marks.tolist():
            name = f"ruler/{round(mark / step)}".replace("-", "minus")
            words = f"{round(mark / step) * step:.6g} m"
            stage.mesh(name, text_mesh(words, 0.007 * width, align="centre"), _INK)
            stage.place(name, mark, -0.075 * width)

    def _draw_words(self, title: str) -> list[Digits]:
        """Title and legend, with distance and estimate in digits, which are returned."""
        stage, width = self._stage, self._width
        left, size = -0.45 * _NARROW * width, 0.0085 * width
        estimate = paint(*to_rgb(_ESTIMATE))
        lines = (
            (title, _INK),
            ("pursuer", paint(*to_rgb(PURSUER))),
            ("evader", paint(*to_rgb(EVADER))),
            ("distance [m]", _INK),
            ("as the pursuer takes it", estimate),
        )
        for k, (line, colour) in enumerate(lines):
            stage.mesh(f"words/{k}", text_mesh(line, size, bold=k == 0), colour)
            stage.place(f"words/{k}", left, (0.22 - 0.02 * k) * width)
        numbers = []
        for k, colour in ((3, _INK), (4, estimate)):
            path = f"numbers/{k}"
            number = Digits(stage, path, size, colour, places=5, decimals=3)
            stage.place(path, -left - number.width, (0.22 - 0.02 * k) * width)
            numbers.append(number)
        return numbers

    def _set_camera(self, middle: float) -> None:
        meshcat, width = self.meshcat, self._width
        # Seen from afar, nearly in parallel. A page of another shape keeps the middle of a
        # perspective camera's picture, and the left edge of an orthographic one's.
        field = 2 * math.degrees(math.atan(0.5 / _ASPECT / _AFAR))
        meshcat.SetCamera(
            Meshcat.PerspectiveCamera(
                fov=field, aspect=_ASPECT, near=0.01 * width, far=2 * _AFAR * width
            )
        )
        centre = np.array([middle, 0.0, 0.0])
        eye = centre + _AFAR * width * np.array([0.0, -math.sin(_TILT), math.cos(_TILT)])
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


# Unit and meaning of each entry of a summary.
ROWS = {
    "controller": ("", "P, PI, PD or PID"),
    "seconds": ("s", "simulated"),
    "delay": ("s", "of the estimate, in whole samples"),
    "lost": ("", "whether the distance grew beyond all bounds"),
    "end": ("m", "true distance at the end"),
    "mean_distance": ("m", "over the second half"),
    "rms_miss": ("m", "of the distance from where the loop rests, over the second half"),
    "least_distance": ("m", "on the whole way"),
    "largest_distance": ("m", "on the whole way"),
    "rms_command": ("m/s", "over the second half"),
    "limited_share": ("", "of the samples at which the command is at its limit"),
}


def simulation_summary(scenario: StandoffScenario, run: StandoffRun) -> dict[str, object]:
    """Numbers of a run, ready for JSON; see `ROWS`.

    Args:
        scenario: What was simulated.
        run: Its samples.
    """
    distance, half = run.distance, len(run.times) // 2
    rest, limit = wanted_equilibrium(scenario.loop).y, scenario.sampled.limit
    late = distance[half:]
    share = 0.0 if math.isinf(limit) else float(np.mean(np.abs(run.command) > limit * (1 - 1e-9)))
    return {
        "controller": scenario.loop.controller,
        "seconds": float(run.times[-1]),
        "delay": scenario.delay_samples * scenario.sampled.period,
        "lost": run.lost,
        "end": None if run.lost else float(distance[-1]),
        "mean_distance": None if run.lost else float(late.mean()),
        "rms_miss": None if run.lost else float(np.sqrt(np.mean((late - rest) ** 2))),
        "least_distance": float(distance.min()),
        "largest_distance": float(distance.max()),
        "rms_command": float(np.sqrt(np.mean(run.command[half:] ** 2))),
        "limited_share": share,
    }


def write_simulation(
    folder: Path, scenario: StandoffScenario, run: StandoffRun, summary: dict[str, object]
) -> list[str]:
    """Write summary.json, run.csv, run.png and replay.html; returns their names.

    Args:
        folder: Exists.
        scenario: What was simulated.
        run: Its samples.
        summary: See `simulation_summary`.
    """
    write_json(folder / "summary.json", summary)
    columns = [run.times, run.evader, run.pursuer, run.estimate, run.command]
    np.savetxt(
        folder / "run.csv",
        np.column_stack(columns),
        fmt="%.9g",
        delimiter=",",
        header="time [s],evader [m],pursuer [m],estimate [m],command [m/s]",
        comments="",
    )
    save_run_picture(folder / "run.png", scenario, run)
    loop = scenario.loop
    title = f"{loop.controller}: keep {loop.reference:g} m"
    write_standoff_replay(folder / "replay.html", run, title)
    return ["summary.json", "run.csv", "run.png", "replay.html"]

"""Playing a game that is tracked on pictures, from start to loss of sight or to the horizon."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from ...systems.numerics.errors import require_type
from ..tracking.controls import add_controls, make_monitor, read_view, remove_controls
from ..tracking.run import LOGGED, TrackingRun
from ..tracking.scene import TrackingScene, View
from .make_picture_tracking import MakePictureTracking
from .picture_scene import PictureScene
from .scenario import PictureGame

Scene = TypeVar("Scene", TrackingScene, PictureScene)

# What is logged beside what every tracking run logs.
SEEN = ("evader_estimate", "evader_known", "valid", "frame")


@dataclass(frozen=True, eq=False)
class PictureRun:
    """What happened in a game tracked on pictures.

    Attributes:
        game: What was played.
        tracking: The game itself, as `sightfield track` has it; its scene is the map's.
        estimate: Where the pursuers put the evaders, shape (T, Ne, 2) [m].
        known: Which they had seen, shape (T, Ne), bool.
        valid: Whose picture gave an estimate of whom, shape (T, Np, Ne), bool.
        arrived: Whose latest picture arrived, shape (T, Np), bool.
        pictures: Where the pictures were drawn, or None.
    """

    game: PictureGame
    tracking: TrackingRun
    estimate: np.ndarray
    known: np.ndarray
    valid: np.ndarray
    arrived: np.ndarray
    pictures: PictureScene | None

    @property
    def errors(self) -> np.ndarray:
        """Distance of each estimate from the truth, shape (T, Ne) [m]; NaN before the first."""
        offsets = self.estimate - self.tracking.log["evader_position"]
        return np.where(self.known, np.linalg.norm(offsets, axis=2), np.nan)

    @property
    def meshcat(self) -> Meshcat:
        """Where it was drawn."""
        assert self.tracking.scene is not None
        return self.tracking.scene.meshcat

    def finish_recording(self) -> None:
        """End the recordings of map and pictures, so that a replay can be written."""
        assert self.tracking.scene is not None
        if self.pictures is not None:
            self.pictures.finish_recording()
        self.tracking.scene.finish_recording()


def run_picture_tracking(
    game: PictureGame,
    meshcat: Meshcat | None = None,
    *,
    recording: bool = False,
    live: bool = False,
    realtime_rate: float = 0.0,
    progress: Callable[[float], None] = lambda seconds: None,
) -> PictureRun:
    """Play a game.

    Args:
        game: What is played.
        meshcat: Where to draw it.
        recording: Record what is drawn, for a replay.
        live: Obey the page's controls (pause, stop, speed, whose view).
        realtime_rate: Simulated seconds per second, 0 for as fast as possible.
        progress: Told the simulated time now and then [s].

    Raises:
        InvalidInput: `game` is no PictureGame.
    """
    require_type("game", game, PictureGame)
    scenario = game.scenario
    period, pursuers = scenario.period, scenario.pursuers.size
    builder = DiagramBuilder()
    obeyed = meshcat if live else None
    if obeyed is not None:
        add_controls(obeyed, pursuers=pursuers, realtime_rate=realtime_rate)
    view = (lambda: read_view(obeyed)) if obeyed is not None else View
    tracking = MakePictureTracking(game, meshcat, recording=recording, view=view)
    builder.AddSystem(tracking)
    names = [*LOGGED, *(name for name in SEEN if tracking.HasOutputPort(name))]
    sinks = {name: LogVectorOutput(tracking.GetOutputPort(name), builder, period) for name in names}
    diagram = builder.Build()
    diagram.set_name("picture_tracking_run")
    simulator = Simulator(diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    if obeyed is not None:
        simulator.set_monitor(make_monitor(simulator, obeyed))
    context = simulator.get_context()
    tracking_context = tracking.GetMyContextFromRoot(context)
    loss = tracking.GetOutputPort("loss")
    # Samples everything once: kernels are compiled, or loaded, before the clock starts.
    simulator.Initialize()
    began = time.perf_counter()
    lost_at, steps = math.inf, math.ceil(scenario.seconds / period - 1e-9)
    for step in range(1, steps + 1):
        status = simulator.AdvanceTo(step * period)
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            break  # stopped on the page
        if step == steps:
            # The sample at the horizon itself is otherwise taken in the step that would follow.
            simulator.AdvancePendingEvents()
        lost_at = float(np.asarray(loss.Eval(tracking_context))[0])
        progress(step * period)
        if math.isfinite(lost_at):
            break
    scene = _subsystem(tracking, "scene", TrackingScene)
    pictures = _subsystem(tracking, "picture_scene", PictureScene)
    for each in (scene, pictures):
        if each is not None:
            # The last picture shows how it ended, however long before the end it was due.
            each.ForcedPublish(each.GetMyContextFromRoot(context))
    wall_time = time.perf_counter() - began
    if obeyed is not None:
        remove_controls(obeyed)
    end = min(context.get_time(), scenario.seconds)
    lost = lost_at <= end
    found = {name: sinks[name].FindLog(context) for name in names}
    times = np.asarray(found["assignment"].sample_times())
    # A loss is noticed at the first sample after it, and the diagram stops at the next.
    kept = times < (lost_at + 2 * period if lost else end + period) - 1e-9
    log = {name: each.data().T[kept] for name, each in found.items()}
    return PictureRun(
        game=game,
        tracking=TrackingRun(
            game=game.tracking,
            times=times[kept],
            log=_shaped(log, pursuers),
            tracking_time=lost_at if lost else end,
            lost_evader=int(np.asarray(loss.Eval(tracking_context))[1]) if lost else None,
            wall_time=wall_time,
            scene=scene,
        ),
        **_seen(log, pursuers, scenario.evaders.size),
        pictures=pictures,
    )


def _subsystem(diagram: Diagram, name: str, kind: type[Scene]) -> Scene | None:
    """A subsystem that may not be there."""
    if not diagram.HasSubsystemNamed(name):
        return None
    system = diagram.GetSubsystemByName(name)
    assert isinstance(system, kind)
    return system


def _shaped(log: dict[str, np.ndarray], pursuers: int) -> dict[str, np.ndarray]:
    """Samples in the shapes and types that `TrackingRun` promises."""
    shaped = {name: log[name].reshape(len(log[name]), -1, 2) for name in LOGGED if "_" in name}
    shaped["visibility"] = log["visibility"].reshape(len(log["visibility"]), pursuers, -1) > 0.5
    shaped["assignment"] = np.rint(log["assignment"]).astype(int)
    return {name: shaped[name] for name in LOGGED}


def _seen(log: dict[str, np.ndarray], pursuers: int, evaders: int) -> dict[str, np.ndarray]:
    """What the cameras gave; on true positions, as if every picture arrived and told the truth."""
    samples = len(log["assignment"])
    if "valid" not in log:
        return {
            "estimate": log["evader_position"].reshape(samples, evaders, 2),
            "known": np.ones((samples, evaders), dtype=bool),
            "valid": np.ones((samples, pursuers, evaders), dtype=bool),
            "arrived": np.ones((samples, pursuers), dtype=bool),
        }
    return {
        "estimate": log["evader_estimate"].reshape(samples, evaders, 2),
        "known": log["evader_known"] > 0.5,
        "valid": log["valid"].reshape(samples, pursuers, evaders) > 0.5,
        "arrived": log["frame"].reshape(samples, pursuers, 3)[:, :, 2] > 0.5,
    }

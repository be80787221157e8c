"""Playing a tracking game from start to loss of sight, or to the horizon."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator, SimulatorStatus
from pydrake.systems.framework import Diagram, DiagramBuilder, System
from pydrake.systems.primitives import LogVectorOutput

from ...systems.numerics.errors import require_type
from .controls import add_controls, make_monitor, read_view, remove_controls
from .game import TrackingGame
from .make_tracking import MakeTracking, OwnAssignment
from .scene import TrackingScene, View

# What is logged: exported port, and the shape of one sample after the number of members.
LOGGED = (
    "pursuer_position",
    "evader_position",
    "visibility",
    "assignment",
    "pursuer_velocity",
    "evader_velocity",
)
# Logged where the diagram has it: for how long all evaders can be kept from now on [s].
CERTIFICATE = "certificate"
# Logged of certified pursuers: for how long each keeps its own evader [s], and whether that is void
# because it is deflected.
GUARANTEED_TIME, WITHDRAWN = "guaranteed_time", "withdrawn"

# Without a page, the run looks this often whether sight has been lost [s].
_STRIDE = 1.0


@dataclass(frozen=True, eq=False)
class TrackingRun:
    """What happened in a game.

    Attributes:
        game: What was played.
        times: Samples, shape (T,) [s]; after a loss two more, or one when it is at a sample.
        log: Samples of each port in LOGGED by name: positions and velocities shape (T, N, 2)
            [m], [m/s], visibility (T, Np, Ne) bool, assignment (T, Np) int; and of `certificate`
            (T, 1) [s], infinite if for ever, where the solved visibility game is looked up; of
            certified pursuers also `guaranteed_time` (T, Np) [s] and `withdrawn` (T, Np) bool.
        tracking_time: Until some evader is seen by nobody; the end of the run if never [s].
        lost_evader: Its number, or None.
        wall_time: How long it took [s].
        scene: Where it was drawn, or None.
    """

    game: TrackingGame
    times: np.ndarray
    log: dict[str, np.ndarray]
    tracking_time: float
    lost_evader: int | None
    wall_time: float
    scene: TrackingScene | None


def run_tracking(
    game: TrackingGame,
    meshcat: Meshcat | None = None,
    *,
    assignment: OwnAssignment | None = None,
    pursuit: System | None = None,
    evasion: System | None = None,
    recording: bool = False,
    live: bool = False,
    realtime_rate: float = 0.0,
    progress: Callable[[float], None] = lambda seconds: None,
) -> TrackingRun:
    """Play a game.

    Args:
        game: What is played.
        meshcat: Where to draw it.
        assignment, pursuit, evasion: Of your own, see `AddTracking`.
        recording: Record the pictures for a replay.
        live: Obey the page's controls (pause, stop, speed, whose view).
        realtime_rate: Simulated seconds per second, 0 for as fast as possible.
        progress: Told the simulated time now and then [s].

    Raises:
        InvalidInput: An evader is yours to drive and there is no page; see also `AddTracking`.
    """
    require_type("game", game, TrackingGame)
    scenario = game.scenario
    builder = DiagramBuilder()
    view = (lambda: read_view(meshcat)) if live and meshcat is not None else View
    tracking = MakeTracking(
        game,
        meshcat,
        assignment=assignment,
        pursuit=pursuit,
        evasion=evasion,
        recording=recording,
        view=view,
    )
    builder.AddSystem(tracking)
    if live and meshcat is not None:
        add_controls(
            meshcat,
            pursuers=scenario.pursuers.size,
            realtime_rate=realtime_rate,
            losing_set=tracking.HasOutputPort(CERTIFICATE),
        )
    sinks = {
        name: LogVectorOutput(tracking.GetOutputPort(name), builder, scenario.period)
        for name in (*LOGGED, CERTIFICATE, GUARANTEED_TIME, WITHDRAWN)
        if tracking.HasOutputPort(name)
    }
    diagram = builder.Build()
    diagram.set_name("tracking_run")
    simulator = Simulator(diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    if live and meshcat is not None:
        simulator.set_monitor(make_monitor(simulator, meshcat))
    # Whole periods: the last one may reach beyond the horizon, and is cut off below.
    horizon = scenario.period * math.ceil(scenario.seconds / scenario.period - 1e-9)
    stride = scenario.period if live or meshcat is not None else max(_STRIDE, scenario.period)
    context = simulator.get_context()
    loss = tracking.GetOutputPort("loss")
    tracking_context = tracking.GetMyContextFromRoot(context)
    # Samples everything once: kernels are compiled, or loaded, before the clock starts.
    simulator.Initialize()
    began = time.perf_counter()
    lost_at, reached, strides = math.inf, 0.0, 0
    while reached < horizon and lost_at > reached:
        strides += 1
        goal = min(strides * stride, horizon)
        status = simulator.AdvanceTo(goal)
        if status.reason() == SimulatorStatus.ReturnReason.kReachedTerminationCondition:
            break  # stopped on the page
        reached = goal
        if reached == horizon:
            # The sample at the horizon itself is otherwise taken in the step that would follow.
            simulator.AdvancePendingEvents()
        lost_at = float(np.asarray(loss.Eval(tracking_context))[0])
        progress(reached)
    if meshcat is not None:
        # The last picture shows how it ended, however long before the end it was due.
        scene = _scene_of(tracking)
        scene.ForcedPublish(scene.GetMyContextFromRoot(context))
    wall_time = time.perf_counter() - began
    if live and meshcat is not None:
        remove_controls(meshcat)
    end = min(context.get_time(), scenario.seconds)
    lost = lost_at <= end
    log = {name: sink.FindLog(context) for name, sink in sinks.items()}
    times = np.asarray(log["assignment"].sample_times())
    # A loss is noticed at the first sample after it, and the diagram stops at the next.
    kept = times < (lost_at + 2 * scenario.period if lost else end + scenario.period) - 1e-9
    return TrackingRun(
        game=game,
        times=times[kept],
        log=_shaped({name: each.data().T[kept] for name, each in log.items()}, game),
        tracking_time=lost_at if lost else end,
        lost_evader=int(np.asarray(loss.Eval(tracking_context))[1]) if lost else None,
        wall_time=wall_time,
        scene=_scene_of(tracking) if meshcat is not None else None,
    )


def _scene_of(tracking: Diagram) -> TrackingScene:
    scene = tracking.GetSubsystemByName("scene")
    assert isinstance(scene, TrackingScene)
    return scene


def _shaped(log: dict[str, np.ndarray], game: TrackingGame) -> dict[str, np.ndarray]:
    """Samples in the shapes and types that `TrackingRun` promises."""
    pursuers = game.scenario.pursuers.size
    planar = [name for name in LOGGED if "_" in name]
    shaped = {name: log[name].reshape(len(log[name]), -1, 2) for name in planar}
    shaped["visibility"] = log["visibility"].reshape(len(log["visibility"]), pursuers, -1) > 0.5
    shaped["assignment"] = np.rint(log["assignment"]).astype(int)
    shaped |= {name: log[name] for name in (CERTIFICATE, GUARANTEED_TIME) if name in log}
    if WITHDRAWN in log:
        shaped[WITHDRAWN] = log[WITHDRAWN] > 0.5
    return {name: shaped[name] for name in log}

"""Harvesting a field from start to the last grain, or to the horizon."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from ...systems.numerics.harvest.driving.record import routes_noted
from ...systems.numerics.harvest.machines.filling import COLUMNS, DONE
from ...systems.numerics.harvest.strategies.serving import STAY
from .job import HarvestJob
from .make_harvest import MakeHarvest
from .scene.harvest_scene import HarvestScene

# What is logged, by exported port, and the length of one row of it (0: one number each).
LOGGED = {
    "pose": 3,
    "station": 0,
    "tank": 0,
    "mode": 0,
    "state": 4,
    "load": 0,
    "delivered": 0,
    "alongside": 0,
    "task": 0,
    "doing": 0,
}
# Between two samples of the log, and between two looks whether all is done [s].
LOG_PERIOD, STRIDE = 0.5, 10.0


@dataclass(frozen=True, eq=False)
class HarvestRun:
    """What happened in a harvest.

    Attributes:
        job: What was done.
        times: Samples, shape (T,) [s].
        log: Samples of each port in LOGGED by name, shape (T, N or K) or (T, N or K, 3 or 4).
        account: Columns of `machines.filling` for each combine at the end, shape (N, 8).
        load: In each cart at the end, shape (K,) [kg].
        delivered: By each cart to its truck, shape (K,) [kg].
        routes: Where each route of a cart came from, the time on it [s] and a time that none can
            beat [s], as in `driving.record`, shape (R, 3).
        record: Of the monitor, shape (4 + K,).
        finished: Whether all was cut and delivered.
        makespan: When that was; the end of the run if never [s].
        wall_time: How long it took to simulate [s].
        scene: What has recorded it, or None.
    """

    job: HarvestJob
    times: np.ndarray
    log: dict[str, np.ndarray]
    account: np.ndarray
    load: np.ndarray
    delivered: np.ndarray
    routes: np.ndarray
    record: np.ndarray
    finished: bool
    makespan: float
    wall_time: float
    scene: HarvestScene | None


def run_harvest(
    job: HarvestJob,
    meshcat: Meshcat | None = None,
    *,
    recording: bool = False,
    realtime_rate: float = 0.0,
    progress: Callable[[float], None] = lambda share: None,
) -> HarvestRun:
    """Harvest a field.

    Args:
        job: What is to be done.
        meshcat: Where to draw it.
        recording: Record what is drawn for a replay.
        realtime_rate: Simulated seconds per second, 0 for as fast as possible.
        progress: Told now and then which part of the combines' way is driven, in [0, 1].
    """
    builder = DiagramBuilder()
    harvest = MakeHarvest(job, meshcat, recording=recording)
    builder.AddSystem(harvest)
    sinks = {
        name: LogVectorOutput(harvest.GetOutputPort(name), builder, LOG_PERIOD) for name in LOGGED
    }
    diagram = builder.Build()
    diagram.set_name("harvest_run")
    simulator = Simulator(diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    context = simulator.get_context()
    simulator.Initialize()

    def now(name: str) -> np.ndarray:
        return np.asarray(harvest.GetOutputPort(name).Eval(harvest.GetMyContextFromRoot(context)))

    ways = sum(path.length for path in job.coverage.paths)
    horizon = 3600.0 * job.scenario.hours
    began = time.perf_counter()
    finished, strides = False, 0
    while not finished and context.get_time() < horizon:
        strides += 1
        simulator.AdvanceTo(min(strides * STRIDE, horizon))
        done = bool((now("mode") == DONE).all() and (now("task") == STAY).all())
        finished = done and not now("tank").any() and not now("load").any()
        progress(float(now("station").sum()) / ways)
    wall_time = time.perf_counter() - began
    scene = harvest.GetSubsystemByName("scene") if meshcat is not None else None
    if isinstance(scene, HarvestScene):
        # The picture at the very end is otherwise drawn in the step that would follow.
        scene.ForcedPublish(scene.GetMyContextFromRoot(context))
    log = {name: sink.FindLog(context) for name, sink in sinks.items()}
    arrays = {}
    for name, row in LOGGED.items():
        data = log[name].data().T
        arrays[name] = data.reshape(len(data), -1, row) if row else data
    return HarvestRun(
        job=job,
        times=np.asarray(log["tank"].sample_times()),
        log=arrays,
        account=now("account").reshape(-1, COLUMNS).copy(),
        load=now("load").copy(),
        delivered=now("delivered").copy(),
        routes=routes_noted(now("routes")),
        record=now("record").copy(),
        finished=finished,
        makespan=float(context.get_time()),
        wall_time=wall_time,
        scene=scene if recording and isinstance(scene, HarvestScene) else None,
    )

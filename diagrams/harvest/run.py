"""The harvest diagram, and its run to the last grain, or until nothing moves any more."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput

from ...systems.drake_parts import add_named
from ...systems.harvest.machine_drivers import MachineDrivers
from ...systems.harvest.teams import AugerTransfer, CombineTeam, GrainCartTeam
from ...systems.numerics.errors import require_type
from ...systems.numerics.harvest.carts.tanks import EMPTY
from ...systems.numerics.harvest.machines import COLUMNS, CUT, DONE
from .harvest_scene import HarvestScene
from .job import HarvestJob, prepare_harvest
from .scenario import HarvestScenario

# About how long a picture of the scene lasts [s].
PICTURE_PERIOD = 0.5
# What a harvest's diagram puts out, in the order in which data flows, and the numbers for each
# machine; all but accounts is logged.
OUTPUTS = {
    "pose": 3,
    "station": 1,
    "speed": 1,
    "tank": 1,
    "mode": 1,
    "cutting": 1,
    "account": COLUMNS,
    "state": 4,
    "load": 1,
    "delivered": 1,
    "alongside": 1,
    "emptying": 1,
    "late": 1,
}
LOGGED = tuple(name for name in OUTPUTS if name != "account")
# Between two samples of the log at most, and between two looks whether all is done [s].
LOG_PERIOD, STRIDE = 0.5, 10.0
# A run in which nothing moves for so long is over [s].
STILL = 1200.0
# What moves by less stands [m], [kg].
NOTHING = 1e-3


def MakeHarvest(
    scenario: HarvestScenario | HarvestJob,
    meshcat: Meshcat | None = None,
    *,
    recording: bool = False,
) -> Diagram:
    """Make the diagram of a harvest.

    Output ports, in the order in which data flows: `pose` (3 N) [m], [m], [rad], `station` (N)
    [m], `speed` (N) [m/s], `tank` (N) [kg], `mode` (N), `cutting` (N) and `account` (8 N) of the
    combines (see `CombineTeam`); `state` (4 K) [m], [m], [rad], [rad], `load` (K) and `delivered`
    (K) [kg] of the carts; `alongside` (N), the cart that each combine pours into, or -1;
    `emptying` (K), whether each cart is at its truck, and `late` (N + K) [s] (see
    `MachineDrivers`).

    Args:
        scenario: What is harvested, or a job already prepared.
        meshcat: Where to draw it; None draws nothing.
        recording: Record what is drawn, for `write_replay` on the subsystem "scene".

    Raises:
        InvalidInput: See `prepare_harvest`.
        NoPlan: See `prepare_harvest`.
    """
    require_type("scenario", scenario, HarvestScenario, HarvestJob)
    job = prepare_harvest(scenario) if isinstance(scenario, HarvestScenario) else scenario
    builder = DiagramBuilder()
    outputs = AddHarvest(builder, job)
    if meshcat is not None:
        period = job.scenario.period
        scene = HarvestScene(
            job,
            meshcat,
            publish_period=period * max(round(PICTURE_PERIOD / period), 1),
            recording=recording,
        )
        add_named(builder, "scene", scene)
        for k in range(scene.num_input_ports()):
            port = scene.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    for name, output in outputs.items():
        builder.ExportOutput(output, name)
    diagram = builder.Build()
    diagram.set_name("harvest")
    return diagram


def AddHarvest(builder: DiagramBuilder, job: HarvestJob) -> dict[str, OutputPort]:
    """Wire a harvest into a diagram; return its outputs by name (see `MakeHarvest`).

    Raises:
        InvalidInput: `job` is no HarvestJob, or a name in the diagram is taken.
    """
    require_type("job", job, HarvestJob)
    scenario, work = job.scenario, job.work
    carts, period = scenario.carts, scenario.period
    sizes = {"combines": scenario.combines.count, "carts": carts.count}
    systems = {
        "combines": CombineTeam(work, period=period),
        "carts": GrainCartTeam(carts, work.starts, truck_rate=carts.truck_rate, period=period),
        "augers": AugerTransfer(**sizes, cart=carts, reach=job.reach),
        "drivers": MachineDrivers(work, period=period, disturbance=scenario.disturbance),
    }
    outputs: dict[str, OutputPort] = {}
    for name, system in systems.items():
        add_named(builder, name, system)
        for k in range(system.num_output_ports()):
            outputs[system.get_output_port(k).get_name()] = system.get_output_port(k)
    # What the combines have unloaded is what the carts have received.
    outputs["received"] = outputs["unloaded"]
    for system in systems.values():
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    return {name: outputs[name] for name in OUTPUTS}


@dataclass(frozen=True, eq=False)
class HarvestRun:
    """What happened in a harvest.

    Attributes:
        job: What was done.
        times: Samples, shape (T,) [s].
        log: Samples of each port in LOGGED by name, shape (T, N or K) or (T, N or K, 3 or 4).
        account: Columns of accounts in `machines` for each combine at the end, shape (N, 8).
        load: In each cart at the end, shape (K,) [kg].
        delivered: By each cart to its truck, shape (K,) [kg].
        finished: Whether all was cut and delivered.
        stopped: Why the run ended before that, who stands where; empty if it finished.
        makespan: When all was cut and delivered; of a run that did not get there, its end [s].
        wall_time: How long it took to simulate [s].
        scene: What has recorded it, or None.
    """

    job: HarvestJob
    times: np.ndarray
    log: dict[str, np.ndarray]
    account: np.ndarray
    load: np.ndarray
    delivered: np.ndarray
    finished: bool
    stopped: str
    makespan: float
    wall_time: float
    scene: HarvestScene | None

    @property
    def harvested(self) -> np.ndarray:
        """Grain that each combine has cut, shape (N,) [kg]."""
        return self.account[:, CUT]


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
        progress: Told now and then which part of the machines' way is driven, in [0, 1].

    Raises:
        InvalidInput: `job` is no HarvestJob.
    """
    require_type("job", job, HarvestJob)
    builder = DiagramBuilder()
    harvest = MakeHarvest(job, meshcat, recording=recording)
    builder.AddSystem(harvest)
    period = job.scenario.period
    sampled = period * max(int(LOG_PERIOD / period + 1e-9), 1)
    sinks = {
        name: LogVectorOutput(harvest.GetOutputPort(name), builder, sampled) for name in LOGGED
    }
    diagram = builder.Build()
    diagram.set_name("harvest_run")
    simulator = Simulator(diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    context = simulator.get_context()
    simulator.Initialize()

    def now(name: str) -> np.ndarray:
        return np.asarray(harvest.GetOutputPort(name).Eval(harvest.GetMyContextFromRoot(context)))

    def where() -> np.ndarray:
        return np.concatenate([now("station"), now("state"), now("delivered"), now("tank")])

    ways = sum(path.path.length for path in job.plan.service.plans)
    horizon = 3600.0 * job.scenario.hours
    began = time.perf_counter()
    # Carts may wait for trucks longer than anybody waits for anything else.
    still = STILL + max((trip.end - trip.begin for trip in job.plan.service.trips), default=0.0)
    finished, strides = False, 0
    last, moved = where(), 0.0
    while not finished and context.get_time() < horizon and context.get_time() - moved < still:
        strides += 1
        simulator.AdvanceTo(min(strides * STRIDE, horizon))
        here = where()
        if np.abs(here - last).max() > NOTHING:
            last, moved = here, context.get_time()
        finished = bool(_is_done(now("mode"), now("tank"), now("load")))
        progress(float(now("station").sum()) / ways)
    wall_time = time.perf_counter() - began
    scene = harvest.GetSubsystemByName("scene") if meshcat is not None else None
    if isinstance(scene, HarvestScene):
        # The picture at the very end is otherwise drawn in the step that would follow.
        scene.ForcedPublish(scene.GetMyContextFromRoot(context))
    log = {name: sink.FindLog(context) for name, sink in sinks.items()}
    arrays = {}
    for name in LOGGED:
        data = log[name].data().T
        arrays[name] = data.reshape(len(data), -1, OUTPUTS[name]) if OUTPUTS[name] > 1 else data
    times = np.asarray(log["tank"].sample_times())
    ended = float(context.get_time())
    return HarvestRun(
        job=job,
        times=times,
        log=arrays,
        account=now("account").reshape(-1, COLUMNS).copy(),
        load=now("load").copy(),
        delivered=now("delivered").copy(),
        finished=finished,
        stopped="" if finished else _why(arrays, ended, moved, horizon),
        makespan=_done_at(arrays, times, ended) if finished else ended,
        wall_time=wall_time,
        scene=scene if recording and isinstance(scene, HarvestScene) else None,
    )


def _is_done(mode: np.ndarray, tank: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Whether nothing is left to do, shapes (..., N), (..., N), (..., K) -> (...,)."""
    empty = (tank <= EMPTY).all(axis=-1) & (load <= EMPTY).all(axis=-1)
    return (mode == DONE).all(axis=-1) & empty


def _done_at(log: dict[str, np.ndarray], times: np.ndarray, ended: float) -> float:
    """The first sample from which nothing is left to do; a run goes on until somebody looks [s]."""
    left = ~_is_done(log["mode"], log["tank"], log["load"])
    first = int(np.flatnonzero(left).max(initial=-1)) + 1
    return float(times[first]) if first < len(times) else ended


def _why(log: dict[str, np.ndarray], time: float, moved: float, horizon: float) -> str:
    """Why a run ended unfinished, and who stands where with how much, in one line."""
    still = f"nothing has moved since {moved:.0f} s"
    said = [f"the time is up after {time:.0f} s" if time >= horizon else still]
    for n, (pose, mode, tank) in enumerate(
        zip(log["pose"][-1], log["mode"][-1], log["tank"][-1], strict=True)
    ):
        if mode != DONE or tank > EMPTY:
            x, y, _ = pose
            said.append(f"combine {n} is at ({x:.0f}, {y:.0f}) with {tank:.0f} kg")
    for k, (state, load) in enumerate(zip(log["state"][-1], log["load"][-1], strict=True)):
        said.append(f"cart {k} is at ({state[0]:.0f}, {state[1]:.0f}) with {load:.0f} kg")
    return "; ".join(said)

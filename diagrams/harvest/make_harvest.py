"""The harvest diagram: combines, augers, carts, drivers, scheduler, monitor."""

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort

from ...systems.harvest.auger_transfer import AugerTransfer
from ...systems.harvest.cart_driver import CartDriver
from ...systems.harvest.combine_guard import CombineGuard
from ...systems.harvest.combine_team import CombineTeam
from ...systems.harvest.grain_cart_team import GrainCartTeam
from ...systems.harvest.harvest_monitor import HarvestMonitor
from ...systems.harvest.on_demand_scheduler import OnDemandScheduler
from ...systems.harvest.unloading_scheduler import UnloadingScheduler
from .job import HarvestJob, prepare_harvest
from .scenario import HarvestScenario
from .scene.harvest_scene import HarvestScene

# About how long a picture of the scene lasts [s].
PICTURE_PERIOD = 0.5


def MakeHarvest(
    scenario: HarvestScenario | HarvestJob,
    meshcat: Meshcat | None = None,
    *,
    recording: bool = False,
) -> Diagram:
    """Make the diagram of a harvest.

    Output ports, in the order in which data flows: `pose` (3 N) [m], [m], [rad], `station` (N)
    [m], `tank` (N) [kg], `mode` (N) and `account` (8 N) of the combines (see `CombineTeam`);
    `state` (4 K) [m], [m], [rad], [rad], `load` (K) and `delivered` (K) [kg] of the carts;
    `alongside` (N), the cart that each combine pours into, or -1; `task` (K) and `doing` (K) of
    the carts and their `routes` (see `CartDriver`); and the monitor's `record` (4 + K).

    Args:
        scenario: What is harvested, or a job already prepared.
        meshcat: Where to draw it; None draws nothing.
        recording: Record what is drawn, for `write_replay` on the subsystem "scene".

    Raises:
        InvalidInput: See `prepare_harvest`.
    """
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
        builder.AddNamedSystem("scene", scene)
        for k in range(scene.num_input_ports()):
            port = scene.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    for name, output in outputs.items():
        builder.ExportOutput(output, name)
    diagram = builder.Build()
    diagram.set_name("harvest")
    return diagram


def AddHarvest(builder: DiagramBuilder, job: HarvestJob) -> dict[str, OutputPort]:
    """Wire a harvest into a diagram; return its outputs by name (see `MakeHarvest`)."""
    scenario, coverage = job.scenario, job.coverage
    team, carts, period = scenario.combines, scenario.carts, scenario.period
    count = len(coverage.paths)
    sizes = {"combines": count, "carts": carts.count}
    systems = {
        "combines": CombineTeam(
            coverage.paths,
            team,
            density=scenario.density,
            carts=carts.count,
            period=period,
            holds=coverage.holds,
            begins=job.begins.tolist(),
        ),
        "carts": GrainCartTeam(carts, job.starts, truck_rate=carts.truck_rate, period=period),
        "augers": AugerTransfer(**sizes, cart=carts, reach=job.reach),
        "scheduler": UnloadingScheduler(
            [job.timetable.of_cart(k) for k in range(carts.count)],
            combines=count,
            capacity=team.capacity,
            period=period,
        )
        if scenario.strategy == "sequential"
        else OnDemandScheduler(
            **sizes, capacity=team.capacity, threshold=scenario.threshold, period=period
        ),
        "drivers": CartDriver(
            job.planner, job.lanes, job.traffic, job.trucks, reach=job.reach, period=period
        ),
        "guard": CombineGuard(job.traffic, carts, carts=carts.count),
        "monitor": HarvestMonitor(job.ground, job.traffic, carts, carts=carts.count, period=period),
    }
    outputs: dict[str, OutputPort] = {}
    for name, system in systems.items():
        builder.AddNamedSystem(name, system)
        for k in range(system.num_output_ports()):
            outputs[system.get_output_port(k).get_name()] = system.get_output_port(k)
    # What the combines have unloaded is what the carts have received.
    outputs["received"] = outputs["unloaded"]
    for system in systems.values():
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    order = ("pose", "station", "tank", "mode", "account", "state", "load", "delivered")
    return {
        name: outputs[name] for name in (*order, "alongside", "task", "doing", "routes", "record")
    }

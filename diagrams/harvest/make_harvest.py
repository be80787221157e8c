"""The harvest diagram: drivers, combines, augers, carts."""

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort

from ...systems.harvest.auger_transfer import AugerTransfer
from ...systems.harvest.combine_team import CombineTeam
from ...systems.harvest.grain_cart_team import GrainCartTeam
from ...systems.harvest.machine_drivers import MachineDrivers
from .job import HarvestJob, prepare_harvest
from .scenario import HarvestScenario
from .scene.harvest_scene import HarvestScene

# About how long a picture of the scene lasts [s].
PICTURE_PERIOD = 0.5
# What a harvest's diagram puts out, in the order in which data flows.
OUTPUTS = (
    "pose",
    "station",
    "speed",
    "tank",
    "mode",
    "cutting",
    "account",
    "state",
    "load",
    "delivered",
    "alongside",
    "emptying",
    "late",
)


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
        builder.AddNamedSystem(name, system)
        for k in range(system.num_output_ports()):
            outputs[system.get_output_port(k).get_name()] = system.get_output_port(k)
    # What the combines have unloaded is what the carts have received.
    outputs["received"] = outputs["unloaded"]
    for system in systems.values():
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    return {name: outputs[name] for name in OUTPUTS}

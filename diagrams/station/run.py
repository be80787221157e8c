"""A game on a station: until sight is lost, the horizon, or the operator's word."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System

from ...systems.numerics.errors import InvalidInput, SightfieldError
from ...systems.station.gates import STOPPED
from ..tracking.game import TrackingGame
from ..tracking.make_tracking import OwnAssignment
from ..tracking.run import LOGGED
from .hardware import (
    AFTER_TICK,
    Devices,
    McapRunWriter,
    Operator,
    PortRecorder,
    RunLog,
    RunWriter,
    Shows,
    StatePublisher,
    port_name,
)
from .laboratories import Gaps
from .make_station import AddStationTracking, MakeStation
from .ports import (
    CLOCK,
    COMMANDS,
    IMAGE,
    MODE,
    REASON,
    SENT,
    STANDING,
    device_ports,
    supervisor_ports,
)
from .recording import Memory, open_run_writer, station_tree
from .scenario import StationScenario

# How a run may end.
HORIZON, LOSS, STOP = "the horizon", "an evader was lost", "the operator stopped it"
FAILURE = "a device failed"


@dataclass(frozen=True)
class StationRun:
    """How a run went; what happened in it is in its log.

    Attributes:
        how: HORIZON, LOSS, STOP or FAILURE.
        tracking_time: For which robots ran until some evader was seen by nobody, or the run's end:
            every tick at which one ran counts a period [s].
        lost_evader: Its number, or None.
        wall_time: How long it took [s].
        realtime_factor: Simulated seconds per second.
        failure: What failed, or empty.
    """

    how: str
    tracking_time: float
    lost_evader: int | None
    wall_time: float
    realtime_factor: float
    failure: str = ""


def logged_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of every port in a run's log, by name: devices, strategy, commands."""
    n, m = scenario.tracking.pursuers.size, scenario.tracking.evaders.size
    strategy = dict(zip(LOGGED, (2 * n, 2 * m, n * m, n, 2 * n, 2 * m), strict=True))
    return {
        **device_ports(scenario),
        **supervisor_ports(scenario),
        **{f"tracking.{name}": size for name, size in strategy.items()},
        COMMANDS: 2 * (n + m),
        SENT: 2 * (n + m),
    }


def run_station(
    scenario: StationScenario,
    game: TrackingGame,
    hardware: bool | Devices | RunLog = False,
    *,
    log: Path,
    assignment: OwnAssignment | None = None,
    evasion: System | None = None,
    mode: str = "simulate",
    operator: Operator | None = None,
    view: Shows | None = None,
    realtime_rate: float = 1.0,
    ticks: int | None = None,
    at_tick: Callable[[float], None] = lambda time: None,
) -> StationRun:
    """Run a game on a station, and write down everything that its ports say.

    A device that fails while robots are driven ends the run, and what was until then is kept.

    Args:
        scenario: The laboratory.
        game: Its game, set up.
        hardware: As of `MakeStation`.
        log: File to write, which must not exist; as MCAP if its name ends so.
        assignment, evasion: Of your own, instead of the scenario's, as of `AddTracking`.
        mode: What the log says the run was.
        operator: Who may pause and stop.
        view: The operator's view.
        realtime_rate: Simulated seconds per second, 0 for as fast as possible.
        ticks: Run so many and look at nothing else; None: until the run ends.
        at_tick: Told the time after each tick [s].

    Raises:
        SightfieldError: The log cannot be written, a device fails at the first tick, or what is of
            your own does not fit.
    """
    own = {"assignment": assignment, "evasion": evasion}
    about = {
        "mode": mode,
        "scenario": station_tree(scenario, game),
        "own": [name for name, each in own.items() if each is not None],
    }
    # Without a camera there is nothing to see.
    pictures = (IMAGE,) if scenario.omni_camera.source != "none" else ()
    ports = logged_ports(scenario)
    builder = DiagramBuilder()
    station = MakeStation(scenario, hardware, game=game, operator=operator)
    builder.AddSystem(station)
    tracking = AddStationTracking(builder, station, game, **own)
    memory = Memory(builder.GetSystems())
    with open_run_writer(
        log, scenario, game, ports=ports, pictures=pictures, memory=memory.sizes, about=about
    ) as writer:
        _add_recorder(builder, station, tracking, writer, scenario.period)
        if view is not None:
            _add_view(builder, station, tracking, scenario, view)
        diagram = builder.Build()
        diagram.set_name("laboratory")
        simulator = Simulator(diagram)
        simulator.set_target_realtime_rate(realtime_rate)
        context = simulator.get_mutable_context()
        gaps = Gaps(hardware, scenario.period) if isinstance(hardware, RunLog) else None

        def advance(tick: int) -> None:
            """Do all of a tick, and write down what is kept of it."""
            known = None if gaps is None else gaps.memory_after(tick)
            if known is not None:
                # After the tick's updates, and before anything looks.
                simulator.AdvanceTo(tick * scenario.period + 0.5 * AFTER_TICK)
                memory.write(context, known)
            # Midway between two ticks everything that one does is done.
            simulator.AdvanceTo((tick + 0.5) * scenario.period)
            writer.memory(tick * scenario.period, memory.read(context))
            at_tick(tick * scenario.period)

        _look_at_all(diagram)
        # Samples everything once: kernels are compiled, or loaded, before the clock starts.
        simulator.Initialize()
        paced = _paced(advance, simulator, scenario.period)
        clock = station.GetOutputPort(CLOCK)
        return _play(paced, context, tracking["loss"], clock, scenario, operator, ticks)


def _look_at_all(diagram: Diagram) -> None:
    """Compute whatever is recorded once, on the side: the first tick takes no longer than others.

    Kernels that are compiled or loaded meanwhile would let it come a third of a second late.
    """
    recorder: Any = diagram.GetSubsystemByName("recorder")
    aside = recorder.GetMyContextFromRoot(diagram.CreateDefaultContext())
    for index in range(recorder.num_input_ports()):
        recorder.get_input_port(index).Eval(aside)


def _paced(
    advance: Callable[[int], None], simulator: Simulator, period: float
) -> Callable[[int], None]:
    """Ticks that do not make up for late ones.

    Several ticks at once would show the strategy and the supervisor a world in which robots hardly
    move for as long as they should.
    """
    rate = simulator.get_target_realtime_rate()
    if rate <= 0:
        return advance
    due = time.perf_counter()

    def advance_in_time(tick: int) -> None:
        nonlocal due
        advance(tick)
        due += period / rate
        now = time.perf_counter()
        if now > due + 0.5 * period / rate:
            simulator.ResetStatistics()
            due = now

    return advance_in_time


def _add_recorder(
    builder: DiagramBuilder,
    station: Diagram,
    tracking: dict[str, OutputPort],
    writer: RunWriter | McapRunWriter,
    period: float,
) -> None:
    recorder = PortRecorder(writer, period=period, offset=AFTER_TICK)
    builder.AddNamedSystem("recorder", recorder)
    commands = builder.GetSubsystemByName("commands").get_output_port()
    for name in (*writer.ports, *writer.pictures):
        if name.startswith("tracking."):
            port = tracking[name.removeprefix("tracking.")]
        else:
            port = commands if name == COMMANDS else station.GetOutputPort(name)
        builder.Connect(port, recorder.GetInputPort(port_name(name)))


def _add_view(
    builder: DiagramBuilder,
    station: Diagram,
    tracking: dict[str, OutputPort],
    scenario: StationScenario,
    view: Shows,
) -> None:
    teams = scenario.tracking
    publisher = StatePublisher(
        view,
        pursuers=teams.pursuers.size,
        evaders=teams.evaders.size,
        period=2 * scenario.period,
        offset=AFTER_TICK,
        looks=2,
    )
    builder.AddNamedSystem("view", publisher)
    for team in ("pursuer", "evader"):
        for name, of_station in (("poses", "believed_poses"), ("valid", "valid"), ("age", "age")):
            port = station.GetOutputPort(f"{team}.{of_station}")
            builder.Connect(port, publisher.GetInputPort(f"{team}_{name}"))
    for name in ("visibility", "assignment"):
        builder.Connect(tracking[name], publisher.GetInputPort(name))
    others = {"quality": "radio.quality", "battery": "radio.battery", "mode": MODE}
    others |= {"sent_command": SENT, "standing": STANDING, "reason": REASON}
    for name, port in others.items():
        builder.Connect(station.GetOutputPort(port), publisher.GetInputPort(name))


def _play(
    advance: Callable[[int], None],
    context: Context,
    loss_port: OutputPort,
    clock_port: OutputPort,
    scenario: StationScenario,
    operator: Operator | None,
    ticks: int | None,
) -> StationRun:
    """Advance tick by tick until the run ends."""
    monitor: Any = loss_port.get_system()
    station: Any = clock_port.get_system()
    loss_context = monitor.GetMyContextFromRoot(context)
    clock_context = station.GetMyContextFromRoot(context)
    period = scenario.period
    count = ticks or math.floor(scenario.seconds / period + 1e-9) + 1
    how, lost, began = HORIZON, np.array([math.inf, -1.0]), time.perf_counter()
    running, before, failure = 0.0, 0.0, ""
    for tick in range(count):
        stopped = operator is not None and operator.mode == STOPPED
        try:
            advance(tick)
        except InvalidInput:
            raise
        except SightfieldError as error:
            if tick == 0:
                raise
            how, failure = FAILURE, str(error)
            break
        lost = np.asarray(loss_port.Eval(loss_context))
        before, running = running, float(np.asarray(clock_port.Eval(clock_context))[0])
        if ticks is None and stopped:
            how = STOP
            break
        if ticks is None and lost[0] < math.inf:
            how = LOSS
            break
    wall_time = time.perf_counter() - began
    end = context.get_time() - 0.5 * period
    return StationRun(
        how=how,
        tracking_time=running - (max(end - lost[0], 0.0) if running > before else 0.0),
        lost_evader=int(lost[1]) if lost[1] >= 0 else None,
        wall_time=wall_time,
        realtime_factor=end / wall_time if wall_time > 0 else math.inf,
        failure=failure,
    )

"""Combines, carts, drivers and augers, wired together: what the plan says comes true."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from sightfield.systems.harvest.machine_drivers import MachineDrivers
from sightfield.systems.harvest.teams import AugerTransfer, CombineTeam, GrainCartTeam
from sightfield.systems.numerics.harvest.execution.advance import Disturbance
from sightfield.systems.numerics.harvest.machines import COLUMNS, CUT, LOST

PERIOD = 0.25
MAKERS = Path(__file__).parents[2] / "numerics" / "harvest" / "carts" / "conftest.py"
# From which system's port to which one's.
WIRES = [
    ("combines.station", "drivers.station"),
    ("combines.speed", "drivers.speed"),
    ("combines.account", "drivers.account"),
    ("carts.state", "drivers.state"),
    ("carts.room", "drivers.room"),
    ("carts.load", "drivers.load"),
    ("augers.alongside", "drivers.alongside"),
    ("augers.alongside", "combines.alongside"),
    ("carts.room", "combines.room"),
    ("drivers.asked", "combines.asked"),
    ("drivers.command", "combines.command"),
    ("drivers.control", "carts.control"),
    ("combines.unloaded", "carts.received"),
    ("drivers.emptying", "carts.emptying"),
    ("combines.pose", "augers.pose"),
    ("carts.state", "augers.state"),
    ("drivers.wanted", "augers.wanted"),
    ("combines.mode", "augers.mode"),
]


@pytest.fixture(scope="module")
def work():
    return runpy.run_path(str(MAKERS))["make_served"]()


class Run:
    """A simulation, and how to look at its ports."""

    def __init__(self, work, disturbance=None, starts=None):
        builder = DiagramBuilder()
        combine, cart = work.size, work.cart
        reach = combine.header_width / 2 + combine.cart_gap + cart.width / 2
        crew = {"combines": len(work.plans), "carts": len(work.motions)}
        self.systems = {
            "drivers": MachineDrivers(work, period=PERIOD, disturbance=disturbance),
            "combines": CombineTeam(work, period=PERIOD),
            "carts": GrainCartTeam(
                cart,
                work.starts if starts is None else starts,
                truck_rate=work.supply.truck_rate,
                period=PERIOD,
            ),
            "augers": AugerTransfer(**crew, cart=cart, reach=reach),
        }
        for name, system in self.systems.items():
            builder.AddNamedSystem(name, system)
        for source, target in WIRES:
            (giver, out), (taker, port) = source.split("."), target.split(".")
            builder.Connect(
                self.systems[giver].GetOutputPort(out), self.systems[taker].GetInputPort(port)
            )
        self.simulator = Simulator(builder.Build())
        self.work = work

    def see(self, name):
        """The value of a port."""
        giver, port = name.split(".")
        system = self.systems[giver]
        context = system.GetMyContextFromRoot(self.simulator.get_context())
        return system.GetOutputPort(port).Eval(context)

    def driven(self):
        """Where drivers think that carts are, shape (K,) [m]."""
        drivers = self.systems["drivers"]
        context = drivers.GetMyContextFromRoot(self.simulator.get_context())
        return context.get_discrete_state_vector().value()[: len(self.work.motions)]


def test_on_time_carts_stay_within_centimetres_of_their_paths_and_all_grain_is_delivered(work):
    run = Run(work)
    motion = work.motions[0]
    far, turned = [], []
    for time in np.arange(0.0, work.end + 2.0, 2 * PERIOD):
        run.simulator.AdvanceTo(time)
        state = run.see("carts.state")
        tractor, _ = motion.poses_at(np.array([time]))
        far.append(np.hypot(*(state[:2] - tractor[0, :2])))
        angle = motion.angles_at(np.array([time]))[0]
        turned.append(abs((state[3] - angle + np.pi) % (2 * np.pi) - np.pi))
        assert run.see("combines.station") == pytest.approx(
            [work.plans[0].station_at(time)], abs=1e-6
        )
    assert max(far) < 0.05
    assert max(turned) < 0.02
    account = run.see("combines.account").reshape(-1, COLUMNS)
    assert account[:, CUT] == pytest.approx([work.grain[0][-1]], abs=1e-6)
    assert account[:, LOST] == pytest.approx([0.0])
    assert run.see("carts.delivered") == pytest.approx(account[:, CUT], abs=1e-6)


def test_a_late_machine_keeps_to_its_path_and_delivers_all(work):
    run = Run(work, Disturbance(slowness=0.2, stops=6.0, seed=3))
    path, far = work.motions[0].timed.path, []
    for time in np.arange(0.0, 1.5 * work.end, 2 * PERIOD):
        run.simulator.AdvanceTo(time)
        pose = path.pose_at(run.driven()[0])
        far.append(np.hypot(*(run.see("carts.state")[:2] - pose[:2])))
        assert run.see("combines.station")[0] <= work.plans[0].station_at(time) + 1e-6
    assert max(far) < 0.05
    assert run.see("drivers.late") == pytest.approx([0.0, 0.0])
    assert run.see("carts.delivered") == pytest.approx([work.grain[0][-1]], abs=1e-6)


def test_a_cart_that_begins_beside_its_path_with_a_bent_trailer_comes_back_to_it(work):
    starts = work.starts + np.array([[0.0, 0.3, 0.05, 0.4]])
    run = Run(work, starts=starts)
    path = work.motions[0].timed.path
    begin = work.motions[0].timed.times[np.argmax(work.motions[0].timed.stations > 60.0)]
    run.simulator.AdvanceTo(np.ceil(begin / PERIOD) * PERIOD)
    pose = path.pose_at(run.driven()[0])
    assert np.hypot(*(run.see("carts.state")[:2] - pose[:2])) < 0.05


def test_grain_flows_only_while_a_cart_is_there(work):
    # Without visits nobody comes: the tank fills up, and the combine stands.
    combines = [replace(combine, capacity=2000.0) for combine in work.combines]
    small = replace(work, combines=combines, visits=(), trips=())
    run = Run(small)
    run.simulator.AdvanceTo(400.0)
    assert run.see("combines.tank") == pytest.approx([2000.0], abs=1e-6)
    assert run.see("combines.mode") == pytest.approx([3.0])
    assert run.see("combines.speed") == pytest.approx([0.0])
    assert run.see("combines.unloaded") == pytest.approx([0.0])
    at = run.see("combines.station")[0]
    run.simulator.AdvanceTo(500.0)
    assert run.see("combines.station")[0] == at


def test_a_run_is_the_same_again_from_its_context(work):
    disturbance = Disturbance(slowness=0.2, stops=6.0, seed=1)
    one, other = Run(work, disturbance), Run(work, disturbance)
    one.simulator.AdvanceTo(100.0)
    other.simulator.AdvanceTo(50.0)
    other.simulator.AdvanceTo(100.0)
    for port in ("combines.pose", "carts.state", "combines.account"):
        assert (one.see(port) == other.see(port)).all()

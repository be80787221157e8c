"""Teams of combines that differ in speed, tank and auger, by the audit and by what they cut."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.carts.cut_times import CELL, cut_times
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines.cart import Cart
from sightfield.systems.numerics.harvest.machines.combine import Combine, CombineSize, size_of
from sightfield.systems.numerics.harvest.plan.combine_plan import plan_combines
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_harvest

SLOW = Combine(speed=1.0, capacity=4000.0, unload_rate=80.0, acceleration=0.3)
USUAL = Combine()
QUICK = Combine(speed=2.0, capacity=12000.0, unload_rate=150.0)


@pytest.fixture(scope="module")
def logs():
    return runpy.run_path(str(Path(__file__).with_name("plan_logs.py")))


def cut_by(plan):
    """What each combine cuts [m^2]."""
    cutter = cut_times(plan.field, plan.size, plan.paths).cutter
    return CELL**2 * np.array([(cutter == n).sum() for n in range(len(plan.paths))])


@pytest.mark.parametrize("team", [(SLOW, QUICK), (QUICK, USUAL, SLOW)])
def test_whoever_is_quicker_cuts_more_and_all_end_together(logs, team):
    plan = plan_combines(Field.rectangle(300.0, 200.0), team)
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    speeds = np.array([combine.speed for combine in team])
    shares = cut_by(plan) / speeds
    # A swath is an eighth of what the slowest cuts: as even as whole swaths allow.
    assert shares.max() / shares.min() < 1.5
    for timed, speed in zip(plan.paths, speeds, strict=True):
        assert timed.speeds.max() <= speed + 1e-9
    equal = plan_combines(plan.field, [Combine(speed=speeds.min())] * len(team))
    assert plan.makespan < equal.makespan


def test_the_order_in_which_combines_are_named_is_of_little_account():
    field = Field.rectangle(300.0, 200.0)
    plans = [plan_combines(field, team) for team in ((SLOW, QUICK), (QUICK, SLOW))]
    assert plans[0].makespan == pytest.approx(plans[1].makespan, rel=0.1)
    assert cut_by(plans[0]) == pytest.approx(cut_by(plans[1])[::-1], rel=0.15)


def test_each_tank_and_each_auger_is_kept_to(logs):
    team = (SLOW, QUICK)
    plan = plan_harvest(
        Field.rectangle(300.0, 200.0), team, Cart(capacity=14000.0), carts=1, density=0.8
    )
    # The audit knows each tank by itself.
    audit = audit_harvest(logs["harvest_log_of"](plan), logs["harvest_site_of"](plan))
    assert audit.faults == ()
    assert plan.service.left == pytest.approx(0.0, abs=10.0)
    for number, combine in enumerate(team):
        visits = [visit for visit in plan.service.visits if visit.combine == number]
        assert max(visit.taken for visit in visits) <= combine.capacity + 250.0
        for visit in visits:
            assert visit.taken / combine.unload_rate <= visit.end - visit.begin + 1.0
    # The large tank is used: it holds three of the small ones.
    assert max(visit.taken for visit in plan.service.visits) > SLOW.capacity + 250.0


@pytest.mark.parametrize("name", ["header_width", "turning_radius", "length", "cart_gap"])
def test_combines_of_other_sizes_are_refused(name):
    other = replace(QUICK, **{name: 1.25 * getattr(QUICK, name)})
    with pytest.raises(InvalidInput, match=f"`{name}` must be the same for all combines"):
        plan_combines(Field.rectangle(300.0, 200.0), [SLOW, other])


def test_a_size_has_neither_speed_nor_tank():
    size = size_of([SLOW, QUICK])
    assert type(size) is CombineSize
    assert size.header_width == SLOW.header_width
    assert not hasattr(size, "speed")
    assert not hasattr(size, "capacity")

"""Plans of combines, on fields of many shapes, by the audit, which shares no code with them."""

import runpy
from pathlib import Path

import pytest

from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.machines.combine import Combine
from sightfield.systems.numerics.harvest.plan.combine_plan import plan_combines

COMBINE = Combine(header_width=7.5, speed=1.6, turning_radius=6.5, length=7.5, width=3.4)


@pytest.fixture(scope="module")
def logs():
    return runpy.run_path(str(Path(__file__).with_name("plan_logs.py")))


@pytest.mark.parametrize(
    ("name", "count"),
    [("rectangle_3", 4), ("rectangle_10", 2), ("trapezium_12", 3), ("l_9", 2), ("pond_10", 2)],
)
def test_the_audit_finds_nothing_in_a_plan(field_makers, logs, name, count):
    field = field_makers[name]()
    plan = plan_combines(field, COMBINE, count)
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    assert audit.figures["min_combine_to_combine"] >= 0.45
    assert audit.figures["crop_under_bodies"] <= 0.002 * field.area
    assert plan.makespan_over_bound < 1.6
    assert plan.waiting < 0.1

"""Plans of combines, on fields of many shapes, by the audit, which shares no code with them."""

import runpy
from pathlib import Path

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.coverage.plan_coverage import BUILT, find_coverages
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines.combine import Combine
from sightfield.systems.numerics.harvest.no_plan import NoPlan
from sightfield.systems.numerics.harvest.plan import combine_plan
from sightfield.systems.numerics.harvest.plan.combine_plan import plan_combines
from sightfield.systems.numerics.harvest.timing.standstill import Block, Standstill

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
    plan = plan_combines(field, [COMBINE] * count)
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    assert audit.figures["min_combine_to_combine"] >= 0.45
    assert audit.figures["crop_under_bodies"] <= 0.002 * field.area
    assert plan.makespan_over_bound < 1.6
    assert plan.waiting < 0.1


def test_combines_on_adjacent_rounds_follow_one_another_inwards(logs):
    field = Field.rectangle(200.0, 150.0, margin=22.0)
    plan = plan_combines(field, [COMBINE] * 2, pattern="thesis")
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    # The first combine's cuts lie on rounds 0, 2, 4, ..., the second one's on those between.
    for number, timed in enumerate(plan.paths):
        path = timed.path
        long = path.cutting & (path.lengths > 60.0)
        middles = (path.poses[:-1, :2] + path.poses[1:, :2])[long] / 2
        depths = field.outline.exterior.distance(shapely.points(middles))
        rounds = np.round(depths / COMBINE.header_width - 0.5)
        assert np.abs(depths / COMBINE.header_width - 0.5 - rounds).max() < 0.05
        assert set(rounds[:6] % 2) == {float(number)}


def test_combines_on_adjacent_rounds_need_room_beside_the_field():
    with pytest.raises(InvalidInput, match="too narrow"):
        plan_combines(Field.rectangle(200.0, 150.0, margin=6.0), [COMBINE] * 2, pattern="thesis")


def test_of_the_best_ways_to_cut_a_field_the_one_that_is_done_first_is_taken(
    field_makers, monkeypatch
):
    timed = []

    def time_machines(*args, **kwargs):
        timed.append(times(*args, **kwargs))
        return timed[-1]

    times = combine_plan.time_machines
    monkeypatch.setattr(combine_plan, "time_machines", time_machines)
    plan = plan_combines(field_makers["zigzag_8"](), [Combine()] * 4)
    makespans = [timetable.makespan for timetable in timed]
    assert plan.makespan == min(makespans)
    # They wait for one another the more in what looked best.
    assert 1 < len(makespans) <= BUILT
    assert makespans[0] > min(makespans)


def test_where_combines_would_block_one_another_the_field_is_cut_another_way(monkeypatch):
    field, combine = Field.rectangle(230.0, 150.0), Combine()
    standstill = Standstill((Block(1, 20.0, (3.0, 4.0), 0, 70.0, "in the way"),), (5, 7))
    blocked = BUILT

    def time_machines(*args, **kwargs):
        nonlocal blocked
        blocked -= 1
        return times(*args, **kwargs) if blocked < 0 else standstill

    times = combine_plan.time_machines
    monkeypatch.setattr(combine_plan, "time_machines", time_machines)
    plan = plan_combines(field, [combine] * 2)
    every = list(find_coverages(field, [combine] * 2))
    assert len(every) > BUILT + 1
    assert plan.coverage.length == pytest.approx(every[BUILT].length)
    blocked = len(every)
    with pytest.raises(NoPlan, match=f"in all of {len(every)} ways .* machine 1 at 20 m"):
        plan_combines(field, [combine] * 2)

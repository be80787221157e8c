"""Plans of combines, on fields of many shapes, by the audit, which shares no code with them."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.harvest_log import HarvestLog, Machine, Part, Site
from sightfield.systems.numerics.harvest.machines.combine import Combine
from sightfield.systems.numerics.harvest.machines.outlines import combine_outline
from sightfield.systems.numerics.harvest.plan.combine_plan import plan_combines

COMBINE = Combine(header_width=7.5, speed=1.6, turning_radius=6.5, length=7.5, width=3.4)
NO_CART = np.zeros((0, 3))


def log_of(plan):
    """What the combines would do, every half second, without any grain."""
    time = np.arange(0.0, plan.makespan + 1.0, 0.5)
    stations = [path.station_at(time) for path in plan.paths]
    pieces = [path.path.piece_at(at) for path, at in zip(plan.paths, stations, strict=True)]
    both = list(zip(plan.paths, pieces, strict=True))
    gears = np.stack([path.path.gears[piece] for path, piece in both], axis=1)
    speeds = np.stack([path.speed_at(time) for path in plan.paths], axis=1)
    return HarvestLog(
        time=time,
        combine_pose=np.stack([path.pose_at(time) for path in plan.paths], axis=1),
        combine_speed=gears * speeds,
        tractor_pose=np.zeros((len(time), 0, 3)),
        trailer_pose=np.zeros((len(time), 0, 3)),
        tank=np.zeros((len(time), len(plan.paths))),
        cart_load=np.zeros((len(time), 0)),
        cutting=np.stack([path.path.cutting[piece] for path, piece in both], axis=1) * 1.0,
        delivered=np.zeros(len(time)),
    )


def site_of(field, count):
    header, body = combine_outline(COMBINE)
    machine = Machine(
        front=header,
        rear=body,
        acceleration=COMBINE.acceleration,
        turning_radius=COMBINE.turning_radius,
    )
    return Site((machine,) * count, (), (Part(field.outline, field.obstacles),), field.margin)


@pytest.mark.parametrize(
    ("name", "count"),
    [("rectangle_3", 4), ("rectangle_10", 2), ("trapezium_12", 3), ("l_9", 2), ("pond_10", 2)],
)
def test_the_audit_finds_nothing_in_a_plan(field_makers, name, count):
    field = field_makers[name]()
    plan = plan_combines(field, COMBINE, count)
    audit = audit_harvest(log_of(plan), site_of(field, count))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    assert audit.figures["min_combine_to_combine"] >= 0.45
    assert audit.figures["crop_under_bodies"] <= 0.002 * field.area
    assert plan.makespan_over_bound < 1.6
    assert plan.waiting < 0.1

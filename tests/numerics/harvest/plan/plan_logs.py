"""Logs of plans as if they were driven on time, for the audit; without any grain."""

import numpy as np

from sightfield.systems.numerics.harvest.audit.harvest_log import HarvestLog, Machine, Part, Site
from sightfield.systems.numerics.harvest.machines.outlines import combine_outline


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


def site_of(plan):
    """The field of a plan and the machines on it."""
    combine, field = plan.combine, plan.field
    header, body = combine_outline(combine)
    machine = Machine(
        front=header,
        rear=body,
        acceleration=combine.acceleration,
        turning_radius=combine.turning_radius,
    )
    return Site(
        (machine,) * len(plan.paths), (), (Part(field.outline, field.obstacles),), field.margin
    )

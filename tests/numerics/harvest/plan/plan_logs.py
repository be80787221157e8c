"""Logs of plans as if they were driven on time, for the audit."""

import dataclasses

import numpy as np

from sightfield.systems.numerics.harvest.audit.harvest_log import HarvestLog, Machine, Part, Site
from sightfield.systems.numerics.harvest.carts.cut_times import CELL, cut_times
from sightfield.systems.numerics.harvest.machines import cart_outline, combine_outline


def log_of(plan, end=0.0):
    """What the combines would do, every half second until all stand, without any grain."""
    time = np.arange(0.0, max(max(path.end for path in plan.paths), end) + 1.0, 0.5)
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
    field = plan.field
    header, body = combine_outline(plan.size)
    machines = tuple(
        Machine(
            front=header,
            rear=body,
            acceleration=combine.acceleration,
            turning_radius=combine.turning_radius,
        )
        for combine in plan.machines
    )
    return Site(machines, (), (Part(field.outline, field.obstacles),), field.margin)


def harvest_log_of(plan):
    """What all machines of a whole harvest would do, and where the grain would be."""
    service, density = plan.service, plan.supply.density
    team = _Driven(service.plans)
    log = log_of(team, max([plan.makespan, *(trip.end for trip in service.trips)]))
    time = log.time

    def shares(moves):
        spans = np.array([[move.begin, move.end] for move in moves]).reshape(-1, 2)
        lasting = np.maximum(spans[:, 1] - spans[:, 0], 1e-9)
        return np.clip((time[:, None] - spans[:, 0]) / lasting, 0.0, 1.0)

    taken = shares(service.visits) * [visit.taken for visit in service.visits]
    brought = shares(service.trips) * [trip.delivered for trip in service.trips]
    combines = np.array([visit.combine for visit in service.visits])
    carts = np.array([visit.cart for visit in service.visits])
    trucks = np.array([trip.cart for trip in service.trips])
    cut = cut_times(plan.combines.field, plan.combines.size, service.plans)
    tanks, loads = [], []
    for n in range(len(service.plans)):
        moments = np.sort(cut.times[cut.cutter == n])
        grain = density * CELL**2 * np.searchsorted(moments, time, side="right")
        tanks.append(np.maximum(grain - taken[:, combines == n].sum(axis=1), 0.0))
    for k in range(len(service.motions)):
        got, gone = taken[:, carts == k].sum(axis=1), brought[:, trucks == k].sum(axis=1)
        loads.append(np.maximum(got - gone, 0.0))
    poses = [motion.poses_at(time) for motion in service.motions]
    return dataclasses.replace(
        log,
        tractor_pose=np.stack([tractor for tractor, _ in poses], axis=1),
        trailer_pose=np.stack([trailer for _, trailer in poses], axis=1),
        tank=np.stack(tanks, axis=1),
        cart_load=np.stack(loads, axis=1),
        delivered=brought.sum(axis=1),
    )


def harvest_site_of(plan):
    """The field of a whole harvest and all machines on it."""
    site, cart = site_of(plan.combines), plan.cart
    tractor, trailer = cart_outline(cart)
    machine = Machine(
        front=tractor,
        rear=trailer,
        capacity=cart.capacity,
        acceleration=cart.acceleration,
        lateral_acceleration=cart.lateral_acceleration,
        turning_radius=cart.turning_radius,
    )
    # What is cut within a second may be more than a tank holds.
    density = plan.supply.density
    within = [c.capacity + 2.0 * c.fill_rate(density) for c in plan.combines.machines]
    return dataclasses.replace(
        site,
        combines=tuple(
            dataclasses.replace(each, capacity=capacity)
            for each, capacity in zip(site.combines, within, strict=True)
        ),
        carts=(machine,) * len(plan.service.motions),
        density=density,
    )


@dataclasses.dataclass
class _Driven:
    paths: list

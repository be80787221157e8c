"""Rounds of the headland: who drives which arcs of them."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..field.field import Field
from .candidates import Candidate
from .driver import Driver, NoWay, drive_gate, find_gate, lay_out_roads, ring_groups
from .rounds import Arc, bay_shifts, come_ahead, drive_arc, line_up, split_loops


def drive_rounds(
    drivers: list[Driver], candidate: Candidate, field: Field, reach: float, *, adjacent: bool
) -> None:
    """Drive all rounds, each split into arcs for all combines, or each by one combine in turn.

    Args:
        drivers: The combines.
        candidate: The way to cut the field.
        field: The field.
        reach: How far a combine cuts until its tank is full [m].
        adjacent: Whether each round is driven by one combine.

    Raises:
        NoWay: The margin is too narrow, or one does not get to its work.
    """
    count, combine = len(drivers), drivers[0].combine
    wide = len(bay_shifts(drivers[0].ground)) > 0
    if adjacent:
        if count > 1 and not wide:
            raise NoWay("combines on adjacent rounds begin side by side on the margin: too narrow")
        line_up(drivers, candidate.rounds[0][0])
    begun: list[Arc] = []
    for number, loops in enumerate(candidate.rounds):
        outer = [loop for loop in loops if not loop.hole]
        if not outer:
            continue
        corners = number == 0 and (not wide or (count == 1 and len(outer[0].corners) > 0))
        team = drivers if not adjacent else [drivers[number % count]]
        preferred = None if number == 0 else np.array([driver.pose for driver in team])
        if adjacent and count > 1 and begun:
            come_ahead(team[0], begun, count, field.polygon)
            preferred = np.array([team[0].pose])
        if number > 0 and count == 1 and len(outer[0].corners):
            corners = True
        speeds = np.array([driver.combine.speed for driver in team])
        arcs = split_loops(outer, speeds, team[0].ground, preferred=preferred, corners=corners)
        begun.append(arcs[0])
        for driver, mine in zip(team, _share_arcs(team, arcs), strict=True):
            for arc in mine:
                drive_arc(driver, arc)
        share_ground(drivers)
        roads = lay_out_roads(
            candidate.region, [(number + 1) * combine.header_width / 2], combine.turning_radius
        )
        for driver in drivers:
            driver.roads = roads
        if number + 1 < len(candidate.rounds):
            _drive_early_rings(drivers, candidate, number, reach)


def _drive_early_rings(
    drivers: list[Driver], candidate: Candidate, number: int, reach: float
) -> None:
    """Drive rings whose outermost is of this round: the next one goes round their holes too."""
    groups = ring_groups(candidate.rounds)
    lanes = [loop for loop in candidate.rounds[number] if not loop.hole]
    for group in groups:
        if group[0].number == number:
            gate = find_gate(group, groups, (), drivers[0], lanes)
            away = [float(np.hypot(*(driver.pose - gate.start)[:2])) for driver in drivers]
            driver = drivers[int(np.argmin(away))]
            driver.go(gate.start)
            drive_gate(driver, gate, None, reach)
    share_ground(drivers)


def _share_arcs(drivers: list[Driver], arcs: list[Arc]) -> list[list[Arc]]:
    """Arcs of each combine: one that is near; those left over go to whoever has least to drive.

    At first combines are nowhere yet: then the faster ones drive the longer arcs.
    """
    speeds = np.array([driver.combine.speed for driver in drivers])
    if not drivers[0].paths:
        shares: list[list[Arc]] = [[] for _ in drivers]
        ranked = np.argsort(-speeds, kind="stable")
        if np.ptp(speeds) > 0.0:
            arcs = sorted(arcs, key=lambda arc: arc.begin - arc.end)
        for k, arc in enumerate(arcs):
            shares[ranked[k % len(drivers)]].append(arc)
        return shares
    away = np.array(
        [
            [np.hypot(*(arc.loop.pose(arc.begin) - driver.pose)[:2]) for arc in arcs]
            for driver in drivers
        ]
    )
    shares = [[] for _ in drivers]
    chosen = linear_sum_assignment(away)
    for who, which in zip(*chosen, strict=True):
        shares[who].append(arcs[which])
    for which in set(range(len(arcs))) - set(chosen[1].tolist()):
        lasting = [sum(arc.end - arc.begin for arc in mine) for mine in shares]
        shares[int(np.argmin(lasting / speeds))].append(arcs[which])
    return shares


def share_ground(drivers: list[Driver]) -> None:
    """Mark for all combines what any of them has cut."""
    cells = np.logical_and.reduce([driver.ground.crop.cells for driver in drivers])
    for driver in drivers:
        driver.ground.crop.cells[:] = cells

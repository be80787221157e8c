"""Combines on adjacent rounds, one behind the other: Zhang 2014, Figure 3.8.

Each round begins ahead of where the one outside of it began, on ground that was cut there by then.
So the combine that has finished a round is ahead of all others, and drives on ahead of them to the
round inside of theirs: nobody passes anybody.
"""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from .arcs import Arc, entry_path, split_loops
from .driver import Driver
from .loops import Loop

# How far ahead of the round outside of its own a round begins [m], and in lengths of that one at
# most.
AHEAD, OF_ROUND = 100.0, 0.2
# Before that it changes lanes, and before that it comes off its bay [m].
BEFORE, COMING_OFF = 30.0, 45.0
# How far behind the one ahead of it a combine may be, beside what rounds begin apart [m].
LAG = 60.0


def ahead_on(loop: Loop) -> float:
    """How far ahead of a round's beginning the next one begins [m]."""
    return min(AHEAD, OF_ROUND * loop.length)


def line_up(drivers: list[Driver], loop: Loop) -> None:
    """Let combines begin one ahead of the other in bays beside the first round.

    Who passes first cuts the ground on which the next one comes off its bay.

    Args:
        drivers: Who have driven nothing yet.
        loop: The first round.
    """
    combine = drivers[0].combine
    first = split_loops(
        [loop], np.array([combine.speed]), drivers[0].ground, preferred=None, corners=False
    )[0]
    for number, driver in enumerate(drivers):
        on = number * ahead_on(loop) - (BEFORE + COMING_OFF) * (number > 0)
        goal = loop.pose((first.begin + on) % loop.length)
        driver.go(entry_path(goal, first.shift, combine, 0).poses[0])


def come_ahead(driver: Driver, begun: list[Arc], count: int, region: BaseGeometry) -> None:
    """Drive to where the next round begins, before those outside of it are finished.

    Args:
        driver: Who drives it.
        begun: Rounds that are driven before it, from the outside.
        count: Of combines.
        region: The field.
    """
    crop = driver.ground.crop
    cells = crop.cells.copy()
    half = driver.combine.header_width / 2
    # Its own last round is done; of those inside of it the ends still stand.
    for behind, arc in enumerate(reversed(begun[-(count - 1) :])):
        standing = (count - 1 - behind) * ahead_on(arc.loop) + LAG
        tail = arc.loop.part(max(arc.begin + ahead_on(arc.loop), arc.end - standing), arc.end)
        strip = shapely.LineString(tail).buffer(half, cap_style="flat", quad_segs=4)
        crop.stand(strip.intersection(region))
    last = begun[-1]
    driver.go(last.loop.pose((last.begin + ahead_on(last.loop) - BEFORE) % last.loop.length))
    crop.cells[:] = cells

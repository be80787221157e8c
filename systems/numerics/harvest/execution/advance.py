"""One step of all machines along their paths.

A machine is never ahead of its plan. One that is on time does what the plan does; one that is late
drives as fast as its path lets it, less what disturbs it, so that

- v^2 <= 2 a (hold - s) for all holds before it: of orders, of ties, of a full tank, of trips;
- s + v^2 / 2 a is at most that of the plan at that time, so that it meets its plan at its speed;
- it speeds up and slows down by a at most, from one step to the next.
"""

import numpy as np

from ...compiled import compiled, kernel
from .disturbance import factor_at
from .fleet import fastest_at, planned_at
from .last_below import last_below
from .orders import PASSED, hold_by
from .visiting import NOTHING, full_hold, loads_of, place_beside, tie_hold

# What is exact to rounding: stations [m] and speeds [m/s] of machines that are on time.
ON_TIME = 1e-6
# A late machine so near to its plan has caught up [m], [m/s].
CAUGHT_UP = 1e-4


@compiled
def drive_on(
    fleet,
    orders,
    pace,
    stations,
    speeds,
    accounts,
    alongside,
    room,
    load,
    carts,
    now,
    step,
):
    """Stations and then speeds of all machines a step later, shape (2 M,) [m], [m/s].

    Each argument is what a port of the drivers has, as it comes.

    Args:
        fleet: The machines.
        orders: What they need of one another.
        pace: How they are disturbed.
        stations, speeds: Of the combines, shape (N,) [m], [m/s].
        accounts, alongside, room, load: See `loads_of`.
        carts: Stations and then speeds of the carts, shape (2 K,) [m], [m/s].
        now: [s].
        step: [s].
    """
    half = len(carts) // 2
    count = len(stations) + half
    after = np.empty(2 * count)
    advance(
        fleet,
        orders,
        pace,
        loads_of(accounts, alongside, room, load),
        np.concatenate((stations, carts[:half])),
        np.concatenate((speeds, carts[half:])),
        now,
        step,
        after[:count],
        after[count:],
    )
    return after


@compiled
def advance(fleet, orders, pace, loads, stations, speeds, now, step, after, after_speeds):
    """Stations and speeds of all machines a step later.

    Args:
        fleet: The machines.
        orders: What they need of one another.
        pace: How they are disturbed.
        loads: Where the grain is.
        stations, speeds: Where they are, shape (M,) [m], [m/s].
        now: [s].
        step: [s].
        after, after_speeds: What comes of it, shape (M,) [m], [m/s].
    """
    for m in range(len(stations)):
        at, speed = planned_at(fleet.planned, m, now)
        punctual = abs(stations[m] - at) <= ON_TIME and abs(speeds[m] - speed) <= ON_TIME
        trusts = pace.undisturbed and punctual
        hold = np.inf
        for n in range(len(stations)):
            if n == m:
                continue
            at, speed = planned_at(fleet.planned, n, now)
            # Machines that are on time, and that nothing disturbs, keep their plan: it is safe.
            if trusts and abs(stations[n] - at) <= ON_TIME and abs(speeds[n] - speed) <= ON_TIME:
                continue
            hold = min(hold, hold_by(orders, m, n, stations[n]))
        hold = min(hold, tie_hold(fleet, orders.ties, loads, stations, speeds, m, trusts))
        if m < fleet.combines:
            hold = min(hold, full_hold(fleet, loads, stations[m], m))
        else:
            load = loads.load[m - fleet.combines]
            for j in range(fleet.trips_at[m], fleet.trips_at[m + 1]):
                if fleet.trips[j] >= stations[m] - PASSED and load > NOTHING:
                    hold = min(hold, fleet.trips[j])
                    break
        beside = place_beside(fleet, orders.ties, stations, speeds, m, step)
        _step(
            fleet,
            m,
            stations[m],
            speeds[m],
            now + step,
            step,
            hold,
            beside,
            factor_at(pace, m, now),
            punctual,
            after,
            after_speeds,
        )


@kernel
def _step(
    fleet, m, station, speed, then, step, hold, beside, factor, punctual, after, after_speeds
):
    """The step of one machine, with its hold, and the place that it should not be beyond."""
    brake = fleet.brakes[m]
    target, target_speed = planned_at(fleet.planned, m, then)
    ahead = target + target_speed * target_speed / (2 * brake)
    # Rounding of holds that are where the plan stands.
    if (
        punctual
        and ahead <= hold + ON_TIME
        and (factor >= 1.0 or target_speed <= factor * fastest_at(fleet.fastest, m, target))
    ):
        after[m], after_speeds[m] = target, target_speed
        return
    end = fleet.halts[fleet.halts_at[m + 1] - 1]
    for h in range(fleet.halts_at[m], fleet.halts_at[m + 1]):
        if fleet.halts[h] > station + PASSED:
            end = fleet.halts[h]
            break
    hold = min(hold, end, ahead)
    most = max(min(target, beside), station)
    low = max(speed - brake * step, 0.0)
    high = speed + brake * step
    if low == 0.0 and station + speed * step / 2 >= hold:
        # It comes to stand within the step, at its hold if that can be.
        least = station + speed * speed / (2 * brake)
        after[m], after_speeds[m] = max(min(hold, target), least), 0.0
    else:
        for _ in range(40):
            middle = (low + high) / 2
            way = (speed + middle) * step / 2
            there = station + way
            if (
                there <= most
                and there + middle * middle / (2 * brake) <= hold
                and _within(fleet.fastest, m, station, speed, there, middle, factor)
            ):
                low = middle
            else:
                high = middle
        after[m], after_speeds[m] = station + (speed + low) * step / 2, low
    if (
        0.0 <= target - after[m] <= CAUGHT_UP
        and abs(target_speed - after_speeds[m]) <= CAUGHT_UP
        and ahead <= hold + CAUGHT_UP
    ):
        after[m], after_speeds[m] = target, target_speed


@kernel
def _within(fastest, m, station, speed, there, then, factor):
    """Whether a step keeps within what the path allows, where it ends and at what it passes."""
    if then > factor * fastest_at(fastest, m, there):
        return False
    k = last_below(fastest.stations, fastest.starts[m], fastest.starts[m + 1], station) + 1
    while k < fastest.starts[m + 1] and fastest.stations[k] < there:
        share = (fastest.stations[k] - station) / (there - station)
        square = speed * speed + share * (then * then - speed * speed)
        if square > fastest.speeds[k] ** 2 * (1 + 1e-9) and then > speed:
            return False
        if square > fastest.speeds[k] ** 2 * (1 + 1e-9) + 1e-9 and share > 0.0:
            return False
        k += 1
    return True

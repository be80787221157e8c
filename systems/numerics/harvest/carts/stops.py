"""Combines that wait for carts, or have parked: where they stop, who comes to them, and how.

If no cart can come before a tank is full, the combine stops where a cart can reach it. At first it
is planned to stand for ever; a cart's way to it is found among all others, which go on or wait for
it; then the stop is shortened to the time that the visit took. Jobs that are no longer possible are
given up.
"""

from collections.abc import Iterator
from itertools import product, tee

import numpy as np

from ...errors import NoPlan
from ..paths import TimedPath
from .cart_motion import CartMotion, Moving, standing_motion
from .cart_plan import FOR_EVER, CartVisit, Job, Stop
from .cut_times import opens_along
from .service import SET_OUT, Service
from .surroundings import (
    SAME,
    CartSurroundings,
    is_in_reach,
    standing_poses,
)
from .tanks import EMPTY

# How many places beside a standing combine are tried, how many places for a stop, and the spacing
# of the latter, as a part of the time left before the tank is full.
PLACES_TRIED, STOPS_TRIED, FARTHER = 8, 12, 0.25
# How many places beside a combine are checked together once it stands, and how many are checked to
# find out whether it may stop somewhere.
TOGETHER, LIKELIEST = 12, 4
# What combines do later than this after a stop is ignored while a way to it is searched [s].
AHEAD = 1500.0


class _TooLate(Exception):
    """A job that has begun would have to be given up."""


def collect(service: Service) -> None:
    """Fetch what is left in a tank when its combine has done its work.

    Args:
        service: What is planned so far; the visit is added.

    Raises:
        NoPlan: No cart gets there.
    """
    plans = service.world.plans
    numbers = [n for n, tank in enumerate(service.tanks) if tank.left > EMPTY]
    numbers.sort(key=lambda n: plans[n].end)
    for number in numbers:
        if visit_standing(service, number, None):
            return
    poses = [np.round(plans[n].path.poses[-1, :2], 1).tolist() for n in numbers]
    raise NoPlan(f"`carts` must find ways to where combines park; got none to {poses[0]}")


def let_wait(service: Service, number: int, full: float) -> None:
    """Let a combine wait at the last place before its tank is full that a cart can reach.

    Args:
        service: What is planned so far; the stop and the visit are added.
        number: Of the combine.
        full: When its tank is full [s].

    Raises:
        NoPlan: No cart gets there.
    """
    plan = service.world.plans[number]
    served = max((v.end for v in service.visits if v.combine == number), default=0.0)
    times = _where_to_stop(service.world, number, full, served, service.settled + 4.0)
    # First try only stops that do not undo the visit for which another combine stops.
    kept = service.kept()
    latest = max([0.0, *(service.standing(cart).since for cart in service.carts)])
    for ahead, gentle in product((AHEAD, np.inf), (True, False) if service.stops else (False,)):
        times, again = tee(times)
        for time in again:
            stop = Stop(number, float(plan.station_at(time)), FOR_EVER)
            service.stops.append(stop)
            if (
                _see(service, max(time, latest) + ahead)
                and visit_standing(service, number, stop)
                and (not gentle or len(service.stops) > len(kept.stops))
            ):
                return
            service.restore(kept)
    raise NoPlan(
        f"`carts` must find ways to combines that wait; got none to combine {number} near "
        f"{np.round(plan.pose_at(full)[:2], 1).tolist()}"
    )


def _where_to_stop(
    world: CartSurroundings, number: int, full: float, served: float, soonest: float
) -> Iterator[float]:
    """When a combine may stop, best moments first: those at which carts reach it, latest first.

    Args:
        world: What carts plan among.
        number: Of the combine.
        full: When its tank is full [s].
        served: When its last visit ends [s].
        soonest: It cannot stop before that [s].

    Yields:
        Moments; if carts can reach it at none of them, the last one before it is full [s].
    """
    plan = world.plans[number]
    found: list[float] = []
    for ready, apart in ((True, 14.0), (False, 60.0)):
        for time in np.arange(full - 4.0, max(served + 4.0, soonest), -5.0).tolist():
            # Farther back the spacing is wider: on a round or ring there may be none for long.
            apart = max(apart, FARTHER * (full - time))
            if len(found) < STOPS_TRIED and all(abs(time - t) >= apart for t in found):
                by_then = time if ready else np.inf
                places = standing_poses(world, plan.pose_at(time), by_then)
                if ready:
                    places = world.planner.with_ways_out(places[:LIKELIEST], time)
                if len(places):
                    found.append(time)
                    yield time
    if not found:
        yield max(full - 4.0, soonest, 0.0)


def hold(service: Service, stop: Stop) -> bool:
    """Let a combine stop for ever, until the duration is known.

    Args:
        service: What is planned so far; the stop is added.
        stop: The stop.

    Returns:
        Whether nothing that has begun would be undone.
    """
    service.stops.append(stop)
    return _see(service)


def visit_standing(service: Service, number: int, stop: Stop | None) -> bool:
    """Serve a combine that stands at the end of its plan, where it waits, or has parked.

    Args:
        service: What is planned so far; the visit is added, and the stop lasts as long as it takes.
        number: Of the combine.
        stop: Its stop, which lasts for ever so far; None: it has parked.

    Returns:
        Whether a cart gets to it and off again.
    """
    spent: list[np.ndarray] = []
    for _ in range(PLACES_TRIED):
        found = _come_to(service, number, spent)
        if found is None:
            return False
        cart, to = found
        stands = service.world.plans[number]
        bent = np.append(to.last_pose, to.last_angle)
        if not is_in_reach(service.world.size, service.cart, stands.pose_at(stands.end), bent):
            spent.append(to.last_pose)
            continue
        begin = max(to.timed.end, stands.end) + 1.0
        pour = service.tanks[number].pour(begin, np.inf, service.room(cart))
        visit = CartVisit(cart, number, begin, pour.end, pour.taken)
        motions = [to, standing_motion(service.cart, to.last_pose, begin, to.last_angle)]
        leaves = Moving(pour.end + 1.0, 0.0)
        if stop is None:
            others = service.other_carts(cart, service.standing(cart).since)
            if service.leave(motions, leaves, visit, others, None):
                return True
        elif _leave_stop(service, motions, leaves, visit, stop):
            return True
        spent.append(to.last_pose)
    return False


def _leave_stop(
    service: Service, motions: list[CartMotion], leaves: Moving, visit: CartVisit, stop: Stop
) -> bool:
    """Let a combine go on when it is empty, or later, so that the cart finds a way off."""
    cart, kept = visit.cart, service.kept()
    stands_from = service.world.plans[visit.combine].end
    others = service.other_carts(cart, service.standing(cart).since)
    stay = motions[-1]
    for turn in range(3):
        time = leaves.time + (1.0, 30.0)[min(turn, 1)]
        if turn == 2:
            # As a last resort it goes on only when the cart has gone.
            first = service.world.planner.route_from(
                stay.last_pose, stay.last_angle, leaves, others, None
            )
            if first is None:
                return False
            time = first.timed.end + 2.0
        final = stop._replace(duration=time - stands_from)
        service.stops = [final if each is stop else each for each in service.stops]
        others = service.other_carts(cart, service.standing(cart).since)
        same = _see(service) and len(service.jobs[cart]) == len(kept.jobs[cart])
        if same and final in service.stops:
            others = service.other_carts(cart, service.standing(cart).since)
            if service.leave(motions, leaves, visit, others, final):
                return True
        service.restore(kept)
    return False


def _come_to(
    service: Service, number: int, spent: list[np.ndarray]
) -> tuple[int, CartMotion] | None:
    """The cart that can reach a standing combine first, and its route; None if there is none.

    Args:
        number: Of the combine.
        spent: Poses that were tried in vain.
    """
    stands_from = service.world.plans[number].end
    pose = service.world.plans[number].pose_at(stands_from)
    planner = service.world.planner
    best: tuple[int, CartMotion] | None = None
    for cart in _by_distance(service, pose):
        stands = service.standing(cart)
        others = service.other_carts(cart, stands.since)
        places = standing_poses(service.world, pose, np.inf, others)
        for each in spent:
            places = places[np.hypot(*(places - each)[:, :2].T) > 0.1]
        by_then = max(stands.since, stands_from)
        for first in range(0, len(places), TOGETHER):
            likely = planner.with_ways_out(places[first : first + TOGETHER], by_then)
            if len(likely):
                break
        else:
            continue
        for begin in service.departures(max(stands.since, stands_from + SET_OUT[0])):
            if best is not None and begin >= best[1].timed.end:
                break
            start = Moving(begin, 0.0)
            to = planner.route_from(stands.pose, stands.beta, start, others, likely)
            if to is not None and to.timed.end < service.world.until - 1.0:
                if best is None or to.timed.end < best[1].timed.end:
                    best = cart, to
                break
    return best


def _by_distance(service: Service, pose: np.ndarray) -> list[int]:
    """Carts with room that have not failed, sorted by the time at which they could be at a pose."""

    def there(cart: int) -> float:
        stands = service.standing(cart)
        return stands.since + float(np.hypot(*(stands.pose - pose)[:2])) / service.cart.speed

    carts = [k for k in range(len(service.jobs)) if service.room(k) > 0 and k != service.failed]
    return sorted(carts, key=there)


def _see(service: Service, until: float = np.inf) -> bool:
    """Update the world to the current stops, and give up jobs that have become impossible.

    Args:
        until: What combines do after this time is ignored [s].

    Returns:
        Whether nothing that has begun would be undone.
    """
    try:
        while True:
            stops, before = len(service.stops), service.world.plans
            since = service.look_again(until)
            _give_up_impossible(service, before, since)
            if len(service.stops) == stops:
                break
            # Stops for what was given up are not needed any more.
    except _TooLate:
        return False
    service.fill_tanks()
    return True


def _give_up_impossible(service: Service, before: list[TimedPath], since: float) -> None:
    """Give up jobs that combines or uncut ground block, or whose combine is elsewhere now."""
    given_up = False
    for cart, jobs in enumerate(service.jobs):
        for number, job in enumerate(jobs):
            if job.end > since and not _is_possible(service, job, before):
                _give_up(service, cart, number)
                given_up = True
                break
    # Carts whose jobs were given up stand for longer, and may be in the way of others.
    while given_up:
        given_up = False
        for cart, jobs in enumerate(service.jobs):
            for number, job in enumerate(jobs):
                if job.end > since and not service.keeps_off(
                    job.motion, service.other_carts(cart, job.begin), 0.0
                ):
                    _give_up(service, cart, number)
                    given_up = True
                    break


def _give_up(service: Service, cart: int, number: int) -> None:
    if service.jobs[cart][number].begin < service.settled:
        raise _TooLate
    lost = {job.stop for job in service.jobs[cart][number:] if job.stop}
    service.jobs[cart] = service.jobs[cart][:number]
    service.stops = [stop for stop in service.stops if stop not in lost]


def _is_possible(service: Service, job: Job, before: list[TimedPath]) -> bool:
    if job.visit:
        times = np.linspace(job.visit.begin, job.visit.end, 9)
        old, new = (
            plans[job.visit.combine].station_at(times) for plans in (before, service.world.plans)
        )
        if np.abs(old - new).max() > SAME:
            return False
    timed = job.motion.timed
    times = np.arange(timed.times[0], timed.end + 1.0, 1.0)
    tractor, trailer = job.motion.poses_at(times)
    planner = service.world.planner
    opens = np.maximum(
        opens_along(service.world.ground, planner.boxes[0], tractor),
        opens_along(service.world.ground, planner.boxes[1], trailer),
    )
    ends = np.array([job.motion.last_pose])
    return bool((opens <= times).all()) and (
        service.keeps_off(job.motion, service.world.combines, 0.0)
        and bool(planner.is_free_for_ever(ends, job.end)[0])
    )

"""The greedy choice of which cart serves which combine next, in which window, and when.

Each combine is due when its tank would be full, or earlier, so that carts can serve one combine
after another. What a cart can reach, and by when, is given: no routes are searched here.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Self

import numpy as np

from ..machines import Combine
from .routes import LONGEST
from .tanks import EMPTY, Tank

# In which order combines are served.
STRATEGIES = ("sequential", "on-demand")
# Time between beginnings that are tried [s]; how many are tried.
TRIED, MOST_TRIED = 15.0, 6
# Part of a tank for which a cart comes, at least.
LEAST = 0.1
# Time that a visit takes a cart in addition to its routes and the flow of grain [s].
AROUND = 25.0
# Time from the nearest node to a place beside a combine [s].
NEAR = 5.0


class Beginnings(NamedTuple):
    """When carts can begin to drive beside combines.

    Attributes:
        times: In order, shape (m,) [s].
        combine: Number of the combine, shape (m,).
        window: Number of the window, shape (m,).
        until: When the window ends, shape (m,) [s].
        node: Of the roadmap, near the pose there, shape (m,).
    """

    times: np.ndarray
    combine: np.ndarray
    window: np.ndarray
    until: np.ndarray
    node: np.ndarray

    def chosen(self, which: np.ndarray) -> Self:
        """Some of them."""
        return self._make(each[which] for each in self)


class FreeCart(NamedTuple):
    """A cart that may be sent.

    Attributes:
        number: Of the cart.
        node: Near which it stands.
        since: When it is free [s].
        room: In it [kg].
        serves: Numbers of the combines that it may serve.
        turn: Number of the combine whose turn it is, if combines are served in turns.
    """

    number: int
    node: int
    since: float
    room: float
    serves: Sequence[int]
    turn: int


class Outlook(NamedTuple):
    """What a choice is made from.

    Attributes:
        combines: The combines.
        density: Of the crop, on the mean [kg/m^2].
        tanks: Of all combines.
        beginnings: When visits can begin.
        carts: The carts that may be sent.
        arrivals: Gives the earliest times at all nodes, (n,) [s], from a node and a time.
        strategy: "sequential" or "on-demand".
        threshold: Part of a tank from which on carts come, unless that is too late.
        hurries: Whether a cart comes as early as is useful, so that others can be served after.
    """

    combines: Sequence[Combine]
    density: float
    tanks: Sequence[Tank]
    beginnings: Beginnings
    carts: Sequence[FreeCart]
    arrivals: Callable[[int, float], np.ndarray]
    strategy: str
    threshold: float
    hurries: bool = False


class Attempt(NamedTuple):
    """A visit that a cart may make.

    Attributes:
        cart, combine: Their numbers.
        window: Number of the window.
        begin: When [s].
    """

    cart: int
    combine: int
    window: int
    begin: float


class _Target(NamedTuple):
    """Possible visits of a cart to a combine.

    Attributes:
        cart: The cart.
        combine: Number of the combine.
        beginnings: Those that are useful.
        first: Number of the preferred beginning.
        deadline: The last of them; infinite if the tank never gets full [s].
        lasts: About how long the visit takes the cart, without its routes [s].
    """

    cart: FreeCart
    combine: int
    beginnings: Beginnings
    first: int
    deadline: float
    lasts: float

    def tried(self, due: float) -> list[int]:
        """Numbers of the beginnings to try, in order, if the visit should begin by `due`."""
        times, first = self.beginnings.times, self.first
        if times[first] > due:
            first = max(int(np.searchsorted(times, due, side="right")) - 1, 0)
        ranked = [*range(first, len(times)), *range(first - 1, -1, -1)]
        ranked.sort(key=lambda k: times[k] > max(due, times[first]))
        kept: list[int] = []
        for k in ranked:
            if len(kept) == MOST_TRIED:
                break
            if all(abs(times[k] - times[each]) >= TRIED - 0.1 for each in kept):
                kept.append(k)
        return kept


def choose_visits(outlook: Outlook) -> Iterator[Attempt | int]:
    """Yield visits that may come next, best first, and finally the combine that has to wait.

    Args:
        outlook: What there is to choose from; some combine has grain.

    Yields:
        Attempts; at last the number of the combine that is full, or has grain, before any cart can
        come to it.
    """
    full = np.array([tank.full_at() for tank in outlook.tanks])
    served = {number for cart in outlook.carts for number in cart.serves}
    targets = []
    for cart in outlook.carts:
        arrivals = outlook.arrivals(cart.node, cart.since)
        for number in cart.serves:
            target = _find_target(outlook, cart, number, float(full[number]), arrivals)
            if target is not None:
                targets.append(target)
    while targets:
        reached = {target.combine for target in targets}
        missed = [n for n in served - reached if full[n] < np.inf]
        target, due = _next_target(outlook, targets)
        tried = target.tried(-np.inf if outlook.hurries else due)
        first = min(missed, key=lambda n: full[n], default=-1)
        if first >= 0 and full[first] < target.beginnings.times[tried[0]]:
            yield first
            return
        for k in tried:
            window, begin = target.beginnings.window[k], target.beginnings.times[k]
            yield Attempt(target.cart.number, target.combine, int(window), float(begin))
        targets.remove(target)
    yield int(np.argmin(full))


def _find_target(
    outlook: Outlook, cart: FreeCart, number: int, full: float, arrivals: np.ndarray
) -> _Target | None:
    """Find the useful visits of a cart to a combine; None if there are none."""
    tank, combine = outlook.tanks[number], outlook.combines[number]
    rate = combine.unload_rate
    if full == np.inf and tank.left <= EMPTY:
        return None
    those = outlook.beginnings
    own = (those.combine == number) & (those.times < full) & (those.times > cart.since)
    there = those.chosen(np.flatnonzero(own & (arrivals[those.node] + NEAR <= those.times)))
    loads = np.interp(there.times, tank.times, tank.load)
    filling = min(combine.fill_rate(outlook.density), 0.9 * rate)
    lasting = np.minimum(loads / (rate - filling), there.until - there.times)
    taken = np.minimum(lasting * rate, cart.room)
    least = LEAST * tank.capacity
    if full == np.inf:
        least = min(least, max(0.8 * tank.left, EMPTY))
    useful = taken >= least
    if not useful.any():
        return None
    good = useful & (loads >= outlook.threshold * tank.capacity)
    good &= taken >= 0.8 * np.minimum(loads, cart.room)
    if not good.any():
        good = useful & (taken >= 0.97 * taken[useful].max())
    chosen = np.flatnonzero(useful)
    first = int(np.argmax(good[chosen]))
    times = there.times[chosen]
    return _Target(
        cart,
        number,
        there.chosen(chosen),
        first,
        float(times[-1]) if full < np.inf else np.inf,
        float(taken[chosen[first]]) / rate + AROUND,
    )


def _next_target(outlook: Outlook, targets: list[_Target]) -> tuple[_Target, float]:
    """The target to serve next, and by when: by the strategy, unless others cannot wait."""
    in_turn, together = outlook.strategy == "sequential", len(outlook.carts)
    if in_turn:
        # The cart that is free first serves one of its own combines.
        cart = min(targets, key=lambda t: t.cart.since).cart
        targets, together = [target for target in targets if target.cart == cart], 1
    # Carts serve one combine after the other: each is due early enough for those due after it.
    by_combine = {t.combine: t for t in sorted(targets, key=lambda t: -t.deadline)}
    order = sorted(by_combine.values(), key=lambda t: t.deadline)
    due = [t.deadline for t in order]
    for k in range(len(order) - together - 1, -1, -1):
        following = k + together
        due[k] = min(due[k], due[following] - _lasts(outlook, order[k], order[following]))
    dues = {t.combine: d for t, d in zip(order, due, strict=True)}

    def begin(target: _Target) -> float:
        return min(float(target.beginnings.times[target.first]), dues[target.combine])

    def rank(target: _Target) -> tuple[float, float]:
        if in_turn:
            turn = (target.combine - target.cart.turn) % len(outlook.tanks)
            return float(turn), begin(target)
        return begin(target), float(target.cart.number)

    first = min(targets, key=rank)
    pressed = [
        t
        for t in targets
        if together == 1
        and dues[t.combine] < dues[first.combine]
        and dues[t.combine] < begin(first) + _lasts(outlook, first, t)
    ]
    if pressed:
        first = min(pressed, key=lambda t: dues[t.combine])
    return first, dues[first.combine]


def _lasts(outlook: Outlook, target: _Target, following: _Target) -> float:
    """Approximate time from the beginning of a visit to that of the next, at its deadline [s]."""
    here, k = target.beginnings, target.first
    leaves = float(here.times[k]) + target.lasts
    there = outlook.arrivals(int(here.node[k]), leaves)[following.beginnings.node[-1]]
    return target.lasts + min(float(there) - leaves, LONGEST)

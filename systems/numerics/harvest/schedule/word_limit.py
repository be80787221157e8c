"""How slowly a cart that repeats a word of visits can drive at most.

A word is what a cart repeats: which combine each visit is to, and after which it drives by the
truck. It may wait, and leave grain behind: because it is full, or because others need it sooner.
The largest factor s on all ways comes from a linear programme. Its other unknowns are, for each
visit, how long the cart stays and what it takes, and for each combine what its tank holds when the
cart leaves it last. Its conditions: no tank runs over before a visit, none holds less than nothing
after it, no auger delivers faster than it can, no cart takes more than it holds between two trips,
and at the end of the word no tank holds more than at its beginning.

The programme has the same answers as that of `periodic_plan`, in a form that suits a search through
thousands of words. A bound on s, which takes no programme, rules most words out. From that bound
the dual simplex method lowers s until all conditions hold, or until s is no better than another
word's, which ends most of the others after a few steps.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, kernel
from .fleet import Fleet, Truck, way_by_truck

Vector = NDArray[np.float64]
Word = NDArray[np.int64]
Trips = NDArray[np.bool_]

# Most steps of the simplex method; words of sixteen visits take some forty.
_MOST_STEPS = 1000
# Tolerance of conditions, coefficients that count as zero, and the cost of all unknowns but s, so
# that no two steps are equally good; the units are a tank and the time that one takes to fill.
_TOLERANCE, _NOTHING, _COST = 1e-9, 1e-9, 1e-8


class Tanks(NamedTuple):
    """What a cart visits.

    Attributes:
        capacities: (N,) [kg].
        fill_rates: (N,) [kg/s].
        net_rates: By which a cart beside them empties them, r_u - r_f, (N,) [kg/s].
    """

    capacities: Vector
    fill_rates: Vector
    net_rates: Vector


class Ways(NamedTuple):
    """What a cart does between two visits.

    Attributes:
        direct: From combine (row) to combine (column), (N, N) [s].
        by_truck: The same by way of the truck, without the time there, (N, N) [s].
        stop: Time at the truck besides unloading [s].
        unloading: How long the truck takes over one unit of grain [s/kg].
        room: What the cart holds; infinite: there is no truck [kg].
    """

    direct: Vector
    by_truck: Vector
    stop: float
    unloading: float
    room: float


def tanks_of(fleet: Fleet) -> Tanks:
    """The tanks of all combines."""
    fill = np.array(fleet.fill_rates)
    return Tanks(np.array(fleet.capacities), fill, np.array(fleet.unload_rates) - fill)


def ways_of(fleet: Fleet, truck: Truck | None, scale: float = 1.0) -> Ways:
    """The ways between all combines, longer by a factor.

    Args:
        fleet: The combines.
        truck: Where carts unload; none: they hold any amount.
        scale: Factor on all ways [-].
    """
    direct = scale * np.array(fleet.travel_times)
    if truck is None:
        return Ways(direct, direct, 0.0, 0.0, math.inf)
    numbers = range(fleet.size)
    rows = [[way_by_truck(fleet, truck, here, there) for there in numbers] for here in numbers]
    return Ways(
        direct,
        scale * np.array(rows),
        truck.stop_time,
        1.0 / truck.unload_rate,
        truck.cart_capacity,
    )


class Desk(NamedTuple):
    """Workspace in which the limits of words are worked out.

    Attributes:
        table: Coefficients of all conditions, (rows, columns).
        right: Their right sides, (rows,).
        costs: Of each unknown, (columns,).
        level: Coefficients of what one tank holds, and a constant; later a row of the table,
            (columns + 1,).
        visits: How often each combine is visited, (N,).
        inside: How often between two visits to one of them, (N,).
    """

    table: Vector
    right: Vector
    costs: Vector
    level: Vector
    visits: NDArray[np.int64]
    inside: NDArray[np.int64]


@compiled
def desk_for(combines: int, visits: int) -> Desk:
    """Workspace for words of at most `visits` visits to `combines` combines."""
    columns = 1 + 2 * visits + combines
    rows = 4 * visits + combines
    return Desk(
        np.zeros((rows, columns)),
        np.zeros(rows),
        np.zeros(columns),
        np.zeros(columns + 1),
        np.zeros(combines, dtype=np.int64),
        np.zeros(combines, dtype=np.int64),
    )


@compiled
def word_limit(word: Word, trips: Trips, tanks: Tanks, ways: Ways, least: float) -> float:
    """The largest factor on all ways with which a word has a plan.

    Minus infinity: it is no more than `least`. Infinite: nothing is driven. nan: not found.

    Args:
        word: The combine of each visit, all of them at least once, (V,).
        trips: Whether the cart drives by the truck after each, (V,).
        tanks: What is visited.
        ways: Between visits.
        least: Factor that it must exceed, at least 0 [-].
    """
    return limit_beyond(word, trips, tanks, ways, least, desk_for(len(tanks[0]), len(word)))


@kernel
def limit_beyond(
    word: Word, trips: Trips, tanks: Tanks, ways: Ways, least: float, desk: Desk
) -> float:
    """`word_limit`, with a workspace that is large enough.

    Args:
        word, trips, tanks, ways: As there.
        least: Factor that it must exceed, at least 0 [-].
        desk: For words of as many visits, or more.
    """
    most = _bound(word, trips, tanks, ways, desk)
    # A bound that exceeds `least` by no more than rounding does not count.
    if most <= least * (1.0 + _TOLERANCE):
        return -np.inf
    if most == np.inf:
        return np.inf
    rows = _write(word, trips, tanks, ways, most, desk)
    return _lower(most, least, rows, 1 + 2 * len(word) + len(tanks.capacities), desk)


@kernel
def _bound(word: Word, trips: Trips, tanks: Tanks, ways: Ways, desk: Desk) -> float:
    """Upper bound of a word's limit: by its period, and by each way back to a combine.

    In a period P the cart unloads f P at each combine. This takes at least f / u of P, and at least
    P - v C / f if its v visits are to find no more than full tanks. The truck gets all, a trip no
    more than the cart holds or finds. The rest of P is left for driving. Between two visits to one
    combine its tank fills during the ways, and during all stays with combines that are visited at
    no other time.
    """
    capacities, fill_rates, net_rates = tanks
    visits, inside = desk.visits, desk.inside
    count, size = len(capacities), len(word)
    visits[:] = 0
    driven, stops = 0.0, 0
    for here in range(size):
        there = here + 1 if here + 1 < size else 0
        visits[word[here]] += 1
        if trips[here]:
            stops += 1
            driven += ways.by_truck[word[here], word[there]]
        elif word[here] == word[there] and size > 1:
            # One visit, written as two.
            return -np.inf
        else:
            driven += ways.direct[word[here], word[there]]
    filled, spare = time_to_drive(tanks, ways.unloading if stops > 0 else 0.0)
    if spare <= 0.0:
        return -np.inf
    if driven == 0.0:
        return np.inf
    standing = stops * ways.stop
    longest = _most_brought(word, trips, tanks, ways.room) / filled
    most: float = -np.inf
    for n in range(count + 1):
        # Periods at which the sum of all stays, as a function of the period, has a bend.
        period = longest
        if n < count:
            net_part = net_rates[n] / (net_rates[n] + fill_rates[n])
            period = min(period, visits[n] * capacities[n] / (fill_rates[n] * net_part))
        if not np.isfinite(period):
            continue
        left = period - standing
        if stops > 0:
            left -= filled * ways.unloading * period
        for k in range(count):
            rate = net_rates[k] + fill_rates[k]
            away = visits[k] * capacities[k] / fill_rates[k]
            left -= max(fill_rates[k] / rate * period, period - away)
        most = max(most, float(left / driven))
    for visit in range(size):
        inside[:] = 0
        way, stop, stays = 0.0, 0.0, 0.0
        here = visit
        while True:
            there = here
            here = here - 1 if here > 0 else size - 1
            if trips[here]:
                way += ways.by_truck[word[here], word[there]]
                stop += ways.stop
            else:
                way += ways.direct[word[here], word[there]]
            n = word[here]
            if n == word[visit]:
                break
            inside[n] += 1
            if inside[n] == visits[n]:
                stays += fill_rates[n] / (net_rates[n] + fill_rates[n])
        # The period is (driven s + standing) / spare at least.
        way += stays * driven / spare
        stop += stays * standing / spare
        here = word[visit]
        filling = capacities[here] / fill_rates[here]
        if way > 0.0:
            most = min(most, float((filling - stop) / way))
        elif filling < stop:
            return -np.inf
    return most


@kernel
def _most_brought(word: Word, trips: Trips, tanks: Tanks, room: float) -> float:
    """The most grain that a cart brings to its truck in all trips of a word; infinite: no truck.

    In a visit it gets what is in a full tank, and what is cut until that is empty.
    """
    if not np.isfinite(room):
        return np.inf
    size, first = len(word), 0
    while first < size and not trips[first]:
        first += 1
    brought, load = 0.0, 0.0
    for visit in range(first + 1, first + 1 + size):
        here = visit % size
        n = word[here]
        load += tanks.capacities[n] * (1.0 + tanks.fill_rates[n] / tanks.net_rates[n])
        if trips[here]:
            brought += float(min(load, room))
            load = 0.0
    return brought


@kernel
def time_to_drive(tanks: Tanks, unloading: float) -> tuple[float, float]:
    """Fill rate of all tanks [kg/s], and largest part of a cart's time that is left for driving.

    Args:
        tanks: What it visits.
        unloading: How long the truck takes over one unit of grain [s/kg].
    """
    filled, spare = 0.0, 1.0
    for n in range(len(tanks.capacities)):
        filled += tanks.fill_rates[n]
        spare -= tanks.fill_rates[n] / (tanks.net_rates[n] + tanks.fill_rates[n])
    return filled, spare - filled * unloading


@kernel
def _write(word: Word, trips: Trips, tanks: Tanks, ways: Ways, most: float, desk: Desk) -> int:
    """Write all conditions, coefficients @ unknowns <= right; return how many there are.

    The unknowns are most - s, stays, what is taken, and last levels, none less than 0.
    """
    capacities, fill_rates, net_rates = tanks
    table, right, level = desk.table, desk.right, desk.level
    size, count = len(word), len(capacities)
    columns = 1 + 2 * size + count
    time_unit, load_unit = 0.0, 0.0
    for n in range(count):
        time_unit = max(time_unit, capacities[n] / fill_rates[n])
        load_unit = max(load_unit, capacities[n])
    table[:, :columns] = 0.0
    rows = 0
    for n in range(count):
        last = size - 1
        while word[last] != n:
            last -= 1
        fill = fill_rates[n] * time_unit / load_unit
        deliver = (net_rates[n] + fill_rates[n]) * time_unit / load_unit
        level[: columns + 1] = 0.0
        level[1 + 2 * size + n] = 1.0
        here = last
        while True:
            there = here + 1 if here + 1 < size else 0
            way = ways.direct[word[here], word[there]]
            if trips[here]:
                way = ways.by_truck[word[here], word[there]]
                level[columns] += fill * ways.stop / time_unit
                brought = here
                while True:
                    level[1 + size + brought] += fill * ways.unloading * load_unit / time_unit
                    brought = brought - 1 if brought > 0 else size - 1
                    if trips[brought] or brought == here:
                        break
            level[0] -= fill * way / time_unit
            level[columns] += fill * most * way / time_unit
            here = there
            level[1 + here] += fill
            if word[here] != n:
                continue
            # At the start of the visit, at its end, and what the auger can do.
            for column in range(columns):
                table[rows, column] = level[column]
                table[rows + 1, column] = -level[column]
            table[rows, 1 + here] -= fill
            right[rows] = capacities[n] / load_unit - level[columns]
            level[1 + size + here] -= 1.0
            table[rows + 1, 1 + size + here] += 1.0
            right[rows + 1] = level[columns]
            table[rows + 2, 1 + size + here] = 1.0
            table[rows + 2, 1 + here] = -deliver
            right[rows + 2] = 0.0
            rows += 3
            if here == last:
                break
        for column in range(columns):
            table[rows, column] = level[column]
        table[rows, 1 + 2 * size + n] -= 1.0
        right[rows] = -level[columns]
        rows += 1
    if not np.isfinite(ways.room):
        return rows
    for visit in range(size):
        if not trips[visit]:
            continue
        brought = visit
        while True:
            table[rows, 1 + size + brought] = 1.0
            brought = brought - 1 if brought > 0 else size - 1
            if trips[brought] or brought == visit:
                break
        right[rows] = ways.room / load_unit
        rows += 1
    return rows


@kernel
def _lower(most: float, least: float, rows: int, columns: int, desk: Desk) -> float:
    """The largest s, found from `most` downwards by the dual simplex method."""
    table, right, costs = desk.table, desk.right, desk.costs
    for column in range(columns):
        costs[column] = _COST * (1.0 + 0.37 * column)
    costs[0] = 1.0
    lowered = 0.0
    # The row of what leaves: beside the table, whose rows the compiler takes for one another.
    pivot = desk.level
    for _ in range(_MOST_STEPS):
        leaves, worst = -1, -_TOLERANCE
        for row in range(rows):
            if right[row] < worst:
                leaves, worst = row, right[row]
        if leaves < 0:
            return most - lowered
        enters, ratio, size = -1, np.inf, 0.0
        for column in range(columns):
            part = -table[leaves, column]
            if part <= _NOTHING:
                continue
            price = costs[column] / part
            if price < ratio or (price == ratio and part > size):
                enters, ratio, size = column, price, part
        if enters < 0:
            return -np.inf
        lowered -= ratio * right[leaves]
        if lowered >= most - least:
            return -np.inf
        inverse = 1.0 / table[leaves, enters]
        for column in range(columns):
            pivot[column] = inverse * table[leaves, column]
            table[leaves, column] = pivot[column]
        table[leaves, enters] = inverse
        right[leaves] *= inverse
        for row in range(rows):
            part = table[row, enters]
            if row == leaves or part == 0.0:
                continue
            other = table[row]
            for column in range(columns):
                other[column] -= part * pivot[column]
            other[enters] = -part * inverse
            right[row] -= part * right[leaves]
        part = costs[enters]
        for column in range(columns):
            costs[column] -= part * pivot[column]
        costs[enters] = -part * inverse
    return np.nan

"""Schedules of small fleets drawn at random: they last, and are never worse with more of anything.

`SEED=950000 NUMBER=300 make bench ARGS="-k small_fleets"` draws others, and as many. What judges
shares nothing with the package: words are driven from event to event, timetables are added up.
"""

import itertools
import math
import os
import time
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.schedule.answer import (
    answer_schedule,
    answer_timetable,
)
from sightfield.systems.numerics.harvest.schedule.fleet import Fleet, Truck

pytestmark = pytest.mark.benchmarks

SEED, NUMBER = (
    int(os.environ.get(name, usual)) for name, usual in (("SEED", 940000), ("NUMBER", 30))
)

# Random words that are driven, rounds of each, and of schedules that are feasible.
WORDS, SHORT_ROUNDS, ROUNDS = 10_000, 12, 400


def test_small_fleets():
    faults, feasible, held = [], 0, Counter()
    least, most_time = math.inf, 0.0
    for seed in range(SEED, SEED + NUMBER):
        random, fleet, carts, truck = draw_fleet(seed)
        began = time.process_time()
        answer = answer_schedule(fleet, carts, truck)
        most_time = max(most_time, time.process_time() - began)
        scale = answer.travel_scale
        for name, more in changes(fleet, carts, truck).items():
            other = answer_schedule(*more)
            # What not even driving in no time would make feasible has a negative factor.
            part = other.travel_scale / scale if 0 < scale < math.inf else math.inf
            least = min(least, part)
            if part < 1 - 2e-3 or answer.feasible > other.feasible:
                faults.append(f"{seed}: {name} makes {scale} {other.travel_scale}")
        if scale < 0 or not math.isfinite(scale):
            continue
        if scale > 0:
            near = answer_schedule(*with_ways(fleet, carts, truck, 0.995 * scale))
            feasible += near.feasible
            if not near.feasible or not runs_for_ever(near):
                faults.append(f"{seed}: does not last at {0.995 * scale}")
        late = with_ways(fleet, carts, truck, 1.005 * max(scale, 1e-3))
        beyond = answer_schedule(*late)
        if carts == 1 and not beyond.feasible:
            assert beyond.certificate is not None
            held[beyond.certificate.holds.value] += 1
            if is_beaten(late[0], late[2], random):
                faults.append(f"{seed}: some word does what is not feasible")
    print(
        f"\n{NUMBER} fleets: with more of something at least {least:.6f} of the factor; {feasible} "
        f"run {ROUNDS} rounds at half a per cent below it; not feasible: {dict(held)}; an answer "
        f"takes {most_time:.1f} s of CPU at most"
    )
    assert not faults


def draw_fleet(seed: int) -> tuple[np.random.Generator, Fleet, int, Truck | None]:
    """Two to four combines at random places, one cart or two, a truck or none."""
    random = np.random.default_rng(seed)
    count, carts = int(random.integers(2, 5)), int(random.integers(1, 3))
    unload, shares = random.uniform(80, 200, count), random.uniform(0.05, 1, count)
    shares = np.minimum(shares * random.uniform(0.2, 0.9) * carts / shares.sum(), 0.9)
    places = random.uniform(0, 100, (count, 2))
    ways = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    fleet = Fleet(
        tuple(random.uniform(3000, 12000, count).tolist()),
        tuple((shares * unload).tolist()),
        tuple(unload.tolist()),
        tuple(map(tuple, ways.tolist())),
    )
    if random.random() >= 0.5:
        return random, fleet, carts, None
    room, away = random.uniform(0.5, 4) * max(fleet.capacities), random.uniform(0, 80)
    truck = Truck(room, away, random.uniform(150, 600), random.uniform(0, 30))
    return random, fleet, carts, truck


def with_ways(fleet, carts, truck, factor):
    """All ways longer by a factor."""
    rows = tuple(tuple(factor * way for way in row) for row in fleet.travel_times)
    if truck is not None:
        truck = replace(truck, travel_time=factor * truck.travel_time)
    return replace(fleet, travel_times=rows), carts, truck


def changes(fleet, carts, truck):
    """More of each thing by a tenth, and another cart."""

    def scaled(name, factor):
        return replace(fleet, **{name: tuple(factor * each for each in getattr(fleet, name))})

    found = {
        "capacities": (scaled("capacities", 1.1), carts, truck),
        "augers": (scaled("unload_rates", 1.1), carts, truck),
        "slower cutting": (scaled("fill_rates", 1 / 1.1), carts, truck),
        "ways": with_ways(fleet, carts, truck, 0.9),
        "another cart": (fleet, carts + 1, truck),
    }
    if truck is not None:
        for name, factor in (
            ("cart_capacity", 1.1),
            ("travel_time", 0.9),
            ("unload_rate", 1.1),
            ("stop_time", 0.9),
        ):
            other = replace(truck, **{name: factor * getattr(truck, name)})
            found[f"truck's {name}"] = (fleet, carts, other)
    return found


def runs_for_ever(answer) -> bool:
    """Whether no tank or cart of the timetable holds more than it can, and no way is too quick."""
    fleet, truck = answer.fleet, answer.truck
    timetable = answer_timetable(answer, ROUNDS)
    sound = not timetable.overflows
    for n in range(fleet.size):
        visits = [visit for visit in timetable.visits if visit.combine == n]
        load, since = visits[0].load_at_start, visits[0].start_unloading
        for visit in visits:
            load += fleet.fill_rates[n] * (visit.start_unloading - since)
            sound &= load <= fleet.capacities[n] * (1 + 1e-6)
            sound &= abs(load - visit.load_at_start) <= 1e-5 * fleet.capacities[n]
            net = fleet.unload_rates[n] - fleet.fill_rates[n]
            load -= net * (visit.emptied - visit.start_unloading)
            since = visit.leave
    for k in range(len(timetable.carts)):
        held = 0.0
        for here, there in itertools.pairwise(timetable.of_cart(k)):
            held += here.taken
            way = fleet.travel_times[here.combine][there.combine]
            if truck is not None:
                sound &= held <= truck.cart_capacity * (1 + 1e-5)
            if here.by_truck:
                way = max(2 * truck.travel_time, way) + truck.stop_time + held / truck.unload_rate
                held = 0.0
            sound &= there.start_unloading - here.leave >= way - 1e-5 * max(1.0, way)
    return bool(sound)


def is_beaten(fleet, truck, random) -> bool:
    """Whether a cart that empties each tank keeps up some of many random words."""
    size = fleet.size
    for length in range(size, 2 * size + 5):
        words = random.integers(0, size, (WORDS // (size + 5), length))
        words = words[[len(set(word)) == size for word in words.tolist()]]
        trips = random.random(words.shape) < random.uniform(0.1, 0.9, (len(words), 1))
        if truck is not None:
            trips[:, -1] = True
        good = fullest(fleet, truck, words, trips, SHORT_ROUNDS) < 1
        if good.any():
            once, twice = (
                fullest(fleet, truck, words[good], trips[good], count * ROUNDS) for count in (1, 2)
            )
            # Where tanks still fill, if slowly, they run over later.
            if ((twice <= 1) & (twice <= once + 1e-6)).any():
                return True
    return False


def fullest(fleet, truck, words, trips, rounds):
    """How full any tank gets, as a part of it, for each word, shape (W,)."""
    capacities, fill, unload = map(
        np.array, (fleet.capacities, fleet.fill_rates, fleet.unload_rates)
    )
    ways, count = np.array(fleet.travel_times), len(words)
    loads, held, most = np.zeros((count, fleet.size)), np.zeros(count), np.zeros(count)
    number = np.arange(count)
    for visit in range(rounds * words.shape[1]):
        here, there = (words[:, (visit - back) % words.shape[1]] for back in (1, 0))
        passed = ways[here, there]
        if truck is not None:
            by_truck = trips[:, (visit - 1) % words.shape[1]]
            longer = np.maximum(2 * truck.travel_time, passed) + truck.stop_time
            passed = np.where(by_truck, longer + held / truck.unload_rate, passed)
            held = np.where(by_truck, 0.0, held)
        loads += fill * passed[:, None]
        most = np.maximum(most, (loads / capacities).max(axis=1))
        found = loads[number, there]
        stay = found / (unload - fill)[there]
        if truck is not None:
            stay = np.minimum(stay, np.maximum(truck.cart_capacity - held, 0) / unload[there])
            held = held + unload[there] * stay
        loads += fill * stay[:, None]
        loads[number, there] = found - (unload - fill)[there] * stay
        most = np.maximum(most, (loads / capacities).max(axis=1))
        loads = np.minimum(loads, 1e3 * capacities)
    return most

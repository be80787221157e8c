"""Whole harvest plans on fields of many shapes: what is left, who stops, how near, how long.

Each plan goes through the audit, which shares no code with the planner.
"""

import os
import runpy
import time
from collections.abc import Iterable
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.carts.visit_choice import STRATEGIES
from sightfield.systems.numerics.harvest.carts.visits import VISITS
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import (
    plan_combines,
    plan_harvest,
    tank_reach,
)

from .drawn_fields import MADE_FIELDS, draw_crew, draw_field

pytestmark = pytest.mark.benchmarks

TESTS = Path(__file__).parents[1] / "tests" / "numerics" / "harvest"
LOGS = runpy.run_path(str(TESTS / "plan" / "plan_logs.py"))
CREWS = [(1, 1), (2, 1), (4, 2)]
# Of the crop [kg/m^2].
DENSITY = 0.8

# The first seed of the drawn fields, and how many: `SEED=5000 NUMBER=300 make bench ...`.
SEED, NUMBER = (
    int(os.environ.get(name, usual)) for name, usual in (("SEED", 1000), ("NUMBER", 72))
)


@pytest.mark.parametrize("name", MADE_FIELDS)
def test_whole_plans(name):
    print()
    for combines, carts in CREWS:
        told = _told(MADE_FIELDS[name](), combines, carts)
        print(f"{name}, {combines} combines, {carts} carts: {told.words}", flush=True)
        assert told.sound is not False


def test_plans_on_drawn_fields():
    print()
    found = []
    for seed in range(SEED, SEED + NUMBER):
        family, field = draw_field(seed)
        combines, carts = draw_crew(seed)
        told = _told(field, combines, carts)
        found.append(told)
        print(f"{seed}, {family}, {combines} combines, {carts} carts: {told.words}", flush=True)
    plans = [each for each in found if each.sound is not None]
    stopped, took = (np.array(column) for column in zip(*(p.figures for p in plans), strict=True))
    print(
        f"{NUMBER} fields: {len(found) - len(plans)} without a plan, "
        f"{sum(each.sound is False for each in plans)} with faults; stops in "
        f"{(stopped > 0).sum()} plans, {stopped.mean():.2%} of the combines' time on average, "
        f"{stopped.max():.1%} at most; {np.median(took):.1f} s of CPU in the median, "
        f"{took.max():.1f} s at most"
    )


def test_visits_of_both_kinds_on_drawn_fields():
    asked = []
    for seed, strategy in product(range(SEED, SEED + NUMBER), STRATEGIES):
        family, field = draw_field(seed)
        asked.append((f"{seed}, {family}", field, *draw_crew(seed), strategy))
    compare_visits(asked)


def test_visits_of_both_kinds_on_made_fields():
    """Two to four combines with one and two carts; NUMBER: how many of the fields."""
    crews = list(product((2, 3, 4), (1, 2)))
    compare_visits(
        (name, MADE_FIELDS[name](), *crew, STRATEGIES[(n + k) % 2])
        for n, name in enumerate(list(MADE_FIELDS)[:NUMBER])
        for k, crew in enumerate(crews)
    )


def compare_visits(asked: Iterable[tuple[str, Field, int, int, str]]) -> None:
    """How often combines stop for carts with greedy visits, and with revised ones.

    Args:
        asked: Names, fields, numbers of combines and of carts, strategies.
    """
    print()
    stops = dict.fromkeys(VISITS, 0)
    waited = dict.fromkeys(VISITS, 0.0)
    unloads = dict.fromkeys(VISITS, 0)
    for name, field, combines, carts, strategy in asked:
        team = [Combine()] * combines
        head = f"{name}, {strategy}, {combines} combines, {carts} carts"
        try:
            paths = plan_combines(field, team, reach=tank_reach(field, team, DENSITY))
        except InvalidInput as fault:
            print(f"{head}: no plan: {fault}", flush=True)
            continue
        told, planned = [], {}
        for visits in VISITS:
            try:
                service = plan_harvest(
                    *(field, team, Cart()),
                    carts=carts,
                    density=DENSITY,
                    strategy=strategy,
                    visits=visits,
                    team=paths,
                ).service
            except InvalidInput as fault:
                told.append(f"{visits}: no plan: {fault}")
                continue
            waits = sum(stop.duration for stop in service.stops)
            planned[visits] = len(service.stops), waits, len(service.visits)
            told.append(
                f"{visits}: {len(service.stops)} stops of {waits:.0f} s, "
                f"{len(service.visits)} unloads"
            )
        print(f"{head}: {'; '.join(told)}", flush=True)
        # Where one of both has no plan there is nothing to compare.
        if len(planned) == len(VISITS):
            for visits, (count, waits, served) in planned.items():
                stops[visits] += count
                waited[visits] += waits
                unloads[visits] += served
    for visits in VISITS:
        print(
            f"{visits}: {stops[visits]} stops of {waited[visits]:.0f} s in all for "
            f"{unloads[visits]} unloads"
        )
    assert stops["revised"] <= stops["greedy"] / 2


class Told(NamedTuple):
    """What came of a plan: in words; whether it is sound, None without one; stops and CPU time."""

    words: str
    sound: bool | None
    figures: tuple[float, float]


def _told(field: Field, combines: int, carts: int) -> Told:
    began = time.process_time()
    try:
        plan = plan_harvest(field, [Combine()] * combines, Cart(), carts=carts, density=DENSITY)
    except InvalidInput as fault:
        return Told(f"no plan: {fault}", None, (0.0, 0.0))
    took = time.process_time() - began
    service = plan.service
    audit = audit_harvest(LOGS["harvest_log_of"](plan), LOGS["harvest_site_of"](plan))
    figures, stops = audit.figures, sum(stop.duration for stop in service.stops)
    words = (
        f"{plan.combines.makespan:.0f} s became "
        f"{max(path.end for path in service.plans):.0f} s; {service.left:.0f} kg left, "
        f"{len(service.visits)} visits, {len(service.stops)} stops of {stops:.0f} s, nearest "
        f"{figures['min_cart_to_combine']:.2f} m to combines, "
        f"{figures['min_cart_to_cart'] or float('inf'):.2f} m to carts, "
        f"{len(audit.faults)} faults, {took:.1f} s of CPU"
    )
    share = stops / (combines * plan.combines.makespan)
    return Told(words, abs(service.left) < 20.0 and audit.faults == (), (share, took))

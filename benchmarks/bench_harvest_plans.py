"""Whole harvest plans on fields of many shapes: what is left, who stops, how near, how long.

Each plan goes through the audit, which shares no code with the planner.
"""

import runpy
import time
from pathlib import Path

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.machines.cart import Cart
from sightfield.systems.numerics.harvest.machines.combine import Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_harvest

pytestmark = pytest.mark.benchmarks

TESTS = Path(__file__).parents[1] / "tests" / "numerics" / "harvest"
FIELDS = runpy.run_path(str(TESTS / "field_makers.py"))["FIELDS"]
LOGS = runpy.run_path(str(TESTS / "plan" / "plan_logs.py"))
CREWS = [(1, 1), (2, 1), (4, 2)]


@pytest.mark.parametrize("name", FIELDS)
def test_whole_plans(name):
    print()
    for combines, carts in CREWS:
        began = time.process_time()
        try:
            plan = plan_harvest(
                FIELDS[name](), Combine(), Cart(), combines=combines, carts=carts, density=0.8
            )
        except InvalidInput as fault:
            print(f"{name}, {combines} combines, {carts} carts: no plan: {fault}")
            continue
        took = time.process_time() - began
        service = plan.service
        audit = audit_harvest(LOGS["harvest_log_of"](plan), LOGS["harvest_site_of"](plan))
        figures = audit.figures
        print(
            f"{name}, {combines} combines, {carts} carts: {plan.combines.makespan:.0f} s became "
            f"{max(path.end for path in service.plans):.0f} s; {service.left:.0f} kg left, "
            f"{len(service.visits)} visits, {len(service.stops)} stops of "
            f"{sum(stop.duration for stop in service.stops):.0f} s, nearest "
            f"{figures['min_cart_to_combine']:.2f} m to combines, "
            f"{figures['min_cart_to_cart'] or float('inf'):.2f} m to carts, "
            f"{len(audit.faults)} faults, {took:.1f} s of CPU",
            flush=True,
        )
        assert abs(service.left) < 20.0
        assert audit.faults == ()

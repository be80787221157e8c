"""Plans of combines on fields of many shapes: how long, how far driven, at what cost, and audited.

FIELDS names some of the fields of the tests, with commas between; all of them without it.
"""

import os
import runpy
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_combines

from .drawn_fields import MADE_FIELDS, draw_field

pytestmark = pytest.mark.benchmarks

TESTS = Path(__file__).parents[1] / "tests" / "numerics" / "harvest"
LOGS = runpy.run_path(str(TESTS / "plan" / "plan_logs.py"))

COMBINE = Combine()


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_plans(count):
    chosen = os.environ.get("FIELDS", ",".join(MADE_FIELDS)).split(",")
    plan_combines(MADE_FIELDS["rectangle_3"](), [COMBINE])
    rows, refused, faults = defaultdict(list), [], []
    for name in chosen:
        field = MADE_FIELDS[name]()
        began = time.process_time()
        try:
            plan = plan_combines(field, [COMBINE] * count)
        except InvalidInput as error:
            refused.append(f"{name}: {str(error)[:150]}")
            continue
        rows["CPU-s"].append(time.process_time() - began)
        rows["makespan over bound"].append(plan.makespan_over_bound)
        rows["length over area / w"].append(
            plan.coverage.length * COMBINE.header_width / field.area
        )
        rows["waiting"].append(plan.waiting)
        audit = audit_harvest(LOGS["log_of"](plan), LOGS["site_of"](plan))
        rows["coverage"].append(audit.figures["coverage"])
        rows["crop under bodies"].append(audit.figures["crop_under_bodies"] / field.area)
        faults += [f"{name}: {fault}" for fault in audit.faults[:2]]
    print(f"\n{count} combines: {len(rows['CPU-s'])} plans of {len(chosen)} fields")
    for what, values in rows.items():
        low, middle, high = np.quantile(values, (0.0, 0.5, 1.0))
        print(f"  {what:22s} median {middle:8.4f}, from {low:8.4f} to {high:8.4f}")
    for line in (*refused, *faults):
        print(f"  {line}")


@pytest.mark.parametrize("header", [4.5, 6.0, 7.5, 12.0])
def test_headers_on_drawn_fields(header):
    seeds = range(9000, 9024)
    refused = []
    for seed in seeds:
        family, field = draw_field(seed)
        try:
            plan_combines(field, [Combine(header_width=header)] * 2)
        except InvalidInput as error:
            refused.append(f"{seed}, {family}: {str(error)[:150]}")
    planned = len(seeds) - len(refused)
    print(f"\ntwo headers of {header} m: {planned} of {len(seeds)} fields planned")
    for line in refused:
        print(f"  {line}")

"""Harvests from the plan to the last grain on fields drawn at random, undisturbed and disturbed.

`SEED=7000 NUMBER=150 make bench ARGS="-k harvest_campaign"` draws other fields, and as many; with
`FIELD_FILES="FILE FILE"`, fields of longitudes and latitudes, `-k made_fields` runs these too.
"""

import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.report import summarise_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import (
    Carts,
    Combines,
    Disturbances,
    FieldSource,
    HarvestScenario,
    OneCombine,
)
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.carts.visit_choice import STRATEGIES
from sightfield.systems.numerics.harvest.machines import Combine

from .drawn_fields import MADE_FIELDS, draw_crew, draw_field

pytestmark = pytest.mark.benchmarks

SEED, NUMBER = (
    int(os.environ.get(name, usual)) for name, usual in (("SEED", 5000), ("NUMBER", 12))
)

FIELD_FILES = os.environ.get("FIELD_FILES", "").split()

# What is asked of a run: grain that may be out of account [kg], crop under bodies in its field's.
GRAIN_ERROR, CROP_UNDER_BODIES = 1e-6, 0.002

# See `summarise_harvest`.
Summary = dict[str, Any]

# One to six combines with one to three carts.
CREWS = [(combines, carts) for combines in range(1, 7) for carts in range(1, 4)]


@pytest.mark.parametrize("name", [*MADE_FIELDS, *FIELD_FILES])
def test_made_fields(name, tmp_path):
    """Half of the crews, the other half on the next field; strategies in turns."""
    print()
    number = [*MADE_FIELDS, *FIELD_FILES].index(name)
    runs = []
    for n, (combines, carts) in enumerate(CREWS):
        if (combines + carts + number) % 2 == 0:
            source = _source(name, tmp_path)
            scenario = usual_scenario(source, combines, carts)
            strategy = STRATEGIES[(n // 2 + number // 2) % 2]
            runs.append((Path(name).stem, replace(scenario, strategy=strategy)))
    report(summaries(runs))


def _source(name: str, folder: Path) -> FieldSource:
    if name in FIELD_FILES:
        return FieldSource(file=str(Path(name).absolute()))
    file = folder / f"{name}.wkt"
    file.write_text(MADE_FIELDS[name]().polygon.wkt)
    return FieldSource(file=str(file), coordinates="metres")


def test_undisturbed(tmp_path):
    print()
    runs = [
        (drawn_name(seed), replace(drawn_scenario(seed, tmp_path), strategy=strategy))
        for seed in range(SEED, SEED + NUMBER)
        for strategy in STRATEGIES
    ]
    report(summaries(runs))


def test_unequal_combines(tmp_path):
    """Speeds, tanks and augers of each combine are drawn, in parts of the usual ones."""
    print()
    runs = []
    for seed in range(SEED, SEED + NUMBER):
        scenario = drawn_scenario(seed, tmp_path)
        random, usual = np.random.default_rng(seed + 3 * 10**6), Combine()
        each = tuple(
            OneCombine(
                speed=usual.speed * random.uniform(0.6, 1.4),
                capacity=usual.capacity * random.uniform(0.5, 1.5),
                unload_rate=usual.unload_rate * random.uniform(0.7, 1.5),
            )
            for _ in range(scenario.combines.count)
        )
        scenario = replace(scenario, combines=replace(scenario.combines, each=each))
        runs.append((drawn_name(seed), replace(scenario, strategy=STRATEGIES[seed % 2])))
    found = summaries(runs)
    report(found)
    ran = [each for each in found if each]
    later = max(abs(each["makespan"] / each["makespan_planned"] - 1.0) for each in ran)
    deviation = max(each["load_deviation"] for each in ran)
    print(
        f"makespans are {later:.2%} off what is planned at most, loads {deviation:.4f} of a tank "
        "on the mean of a run at most"
    )


def test_disturbed(tmp_path):
    print()
    runs = []
    for seed in range(SEED, SEED + NUMBER):
        scenario = drawn_scenario(seed, tmp_path)
        random = np.random.default_rng(seed + 2 * 10**6)
        # A cart that fails for good leaves others to go on.
        fails = scenario.carts.count > 1 and random.random() < 0.5
        disturbance = Disturbances(
            slowness=0.2,
            stops=float(random.uniform(1, 4)),
            longest_stop=120.0,
            seed=seed,
            failing_cart=int(random.integers(scenario.carts.count)) if fails else -1,
            fails_at=float(random.uniform(200, 3000)),
        )
        strategy = STRATEGIES[seed % 2]
        scenario = replace(scenario, strategy=strategy, disturbance=disturbance)
        runs.append((drawn_name(seed), scenario))
    report(summaries(runs))


def drawn_scenario(seed: int, folder: Path) -> HarvestScenario:
    """The field and the crew of a seed."""
    file = folder / f"{seed}.wkt"
    file.write_text(draw_field(seed)[1].polygon.wkt)
    return usual_scenario(FieldSource(file=str(file), coordinates="metres"), *draw_crew(seed))


def drawn_name(seed: int) -> str:
    """What to call a drawn field."""
    return f"{seed}, {draw_field(seed)[0]}"


def usual_scenario(field: FieldSource, combines: int, carts: int) -> HarvestScenario:
    """Machines as they are without a word."""
    return HarvestScenario(
        field=field,
        combines=Combines(count=combines),
        carts=Carts(count=carts),
        period=0.5,
        hours=24.0,
    )


def summaries(runs: Iterable[tuple[str, HarvestScenario]]) -> list[Summary]:
    """What became of each run, told line by line; empty where there was no plan."""
    found = []
    for name, scenario in runs:
        head = f"{name}, {scenario.strategy}: "
        head += f"{scenario.combines.count} combines, {scenario.carts.count} carts"
        try:
            job = prepare_harvest(scenario)
        except InvalidInput as fault:
            found.append({})
            print(f"{head}: no plan: {fault}", flush=True)
            continue
        each = summarise_harvest(run_harvest(job), name)
        found.append(each)
        print(
            f"{head}{'' if each['feasible'] else ' (too few)'}: {wrong(each) or 'sound'}; makespan "
            f"{each['makespan']:.0f} s, {each['makespan_over_bound']:.2f} of the bound, way "
            f"{each['path_over_bound']:.2f}, waiting {each['waiting']:.1%}, stops "
            f"{stops(each):.1%}, {each['unloads_missed']} of {each['unloads']} unloads missed, "
            f"latest {each['latest']:.0f} s, coverage {each['coverage']:.2%}",
            flush=True,
        )
    return found


def wrong(each: Summary) -> str:
    """What a run should not have, in words."""
    faults = []
    if not each["finished"]:
        faults.append(f"unfinished, {each['stopped']}")
    if each["audit_faults"]:
        faults.append(f"{each['audit_faults']} faults")
    if abs(each["grain_error"]) > GRAIN_ERROR or each["grain_lost"]:
        faults.append(f"grain lost {each['grain_lost']} kg, off {each['grain_error']:.1e} kg")
    if each["crop_under_bodies"] > CROP_UNDER_BODIES * each["field_area"]:
        faults.append(f"{each['crop_under_bodies']:.0f} m^2 of crop under bodies")
    return ", ".join(faults)


def stops(each: Summary) -> float:
    """Part of the combines' time that they stand for carts."""
    return each["combine_stop_time"] / (each["combines"] * each["makespan"])


def report(found: list[Summary]) -> None:
    """All runs together; figures of those whose carts suffice by the closed forms."""
    ran = [each for each in found if each]
    unsound = sum(bool(wrong(each)) for each in ran)
    print(f"{len(found)} runs: {len(found) - len(ran)} without a plan, {unsound} not sound")
    enough = [each for each in ran if each["feasible"]]
    for team in sorted({each["combines"] for each in enough}):
        own = [each for each in enough if each["combines"] == team]
        spans, ways = (
            np.median([each[name] for each in own])
            for name in ("makespan_over_bound", "path_over_bound")
        )
        print(
            f"{len(own)} of {team} combines with enough carts: makespan {spans:.2f} of the bound, "
            f"way {ways:.2f} (medians)"
        )
    if enough:
        missed, unloads = (sum(each[n] for each in enough) for n in ("unloads_missed", "unloads"))
        print(
            f"waiting {np.mean([each['waiting'] for each in enough]):.2%}, stops "
            f"{np.mean([stops(each) for each in enough]):.2%} on average, "
            f"{max(stops(each) for each in enough):.1%} at most; {missed} of {unloads} unloads "
            f"missed, {missed / unloads:.1%}; coverage at least "
            f"{min(each['coverage'] for each in enough):.2%}"
        )
    assert unsound == 0
    assert len(ran) == len(found)

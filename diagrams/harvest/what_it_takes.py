"""What a harvest would take: the whole plan of the fleet that is asked for, beside other fleets."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.field.yield_map import mean_density
from ...systems.numerics.harvest.fleets.figures import FleetFigures, figures_of_plan
from ...systems.numerics.harvest.fleets.fleet_table import FleetTable, fleet_table
from ...systems.numerics.harvest.fleets.fuel import FuelModel
from ...systems.numerics.harvest.plan.harvest_plan import plan_harvest
from .scenario import HarvestScenario

# Combines, carts and trucks of the largest fleet in the table, unless told otherwise.
MOST = (6, 4, 3)


@dataclass(frozen=True, eq=False)
class WhatItTakes:
    """The answer to what a harvest would take.

    Attributes:
        scenario: What was asked for.
        field: What is harvested.
        density: Of its crop, on the mean [kg/m^2].
        figures: Of the whole plan of the scenario's fleet.
        table: Of fleets side by side; None if it was not asked for.
    """

    scenario: HarvestScenario
    field: Field
    density: float
    figures: FleetFigures
    table: FleetTable | None


def find_what_it_takes(
    scenario: HarvestScenario,
    folder: Path = Path(),
    most: tuple[int, int, int] | None = MOST,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> WhatItTakes:
    """Plan the fleet that is asked for in full, and fleets of other sizes by the model of carts.

    Args:
        scenario: What is asked for.
        folder: Where the field's file is looked for.
        most: Combines, carts and trucks of the largest fleet in the table; None: no table.
        progress: Told what is done, and which part of it, in [0, 1].

    Raises:
        InvalidInput: The field cannot be read, or a value is out of its range.
        NoPlan: There is no plan for the fleet that is asked for.
    """
    field = scenario.field.load(folder)
    density = scenario.yields.load(field, scenario.density, folder)
    carts, fuel = scenario.carts, FuelModel()
    trucks = scenario.trucks.fleet(carts.count)
    plan = plan_harvest(
        field,
        scenario.planned_combines(),
        scenario.planned_cart,
        carts=carts.count,
        density=density,
        truck_rate=carts.truck_rate,
        trucks=trucks,
        strategy=scenario.strategy,
        threshold=scenario.threshold,
        pattern=scenario.pattern,
        seed=scenario.seed,
        progress=progress,
    )
    figures = figures_of_plan(plan, trucks, fuel)
    table = None
    if most is not None:
        table = fleet_table(
            field,
            scenario.planned_combines(most[0]),
            scenario.planned_cart,
            trucks,
            density=density,
            truck_rate=carts.truck_rate,
            threshold=scenario.threshold,
            pattern=scenario.pattern,
            seed=scenario.seed,
            fuel=fuel,
            most=most[1:],
            planned={scenario.combines.count: plan.combines},
            progress=progress,
        )
    return WhatItTakes(scenario, field, mean_density(density, field.polygon), figures, table)


def as_object(answer: WhatItTakes, name: str) -> dict[str, object]:
    """The answer ready for JSON: SI units, fuel in litres.

    Args:
        answer: What was found.
        name: What to call the scenario.
    """
    found: dict[str, object] = {
        "scenario": name,
        "field_area": answer.field.area,
        "density": answer.density,
        "plan": _row(answer.figures),
    }
    table = answer.table
    if table is not None:
        figures = answer.figures
        same = table.row(figures.combines, figures.carts, figures.trucks)
        found["model_over_plan"] = same.makespan / figures.makespan if same else None
        found["fleets"] = [_row(row) for row in table.rows]
        found["knee"] = _row(table.rows[table.knee])
        found["refused"] = [
            {"combines": combines, "carts": carts or None, "reason": reason}
            for combines, carts, reason in table.refused
        ]
    return found


def _row(figures: FleetFigures) -> dict[str, object]:
    return {
        **dataclasses.asdict(figures),
        "engine_hours": figures.engine_hours,
        "fuel": figures.fuel,
    }

"""What a harvest would take: the whole plan of the fleet that is asked for, beside other fleets.

The picture has time over combines, a line for each number of carts, and the knee marked.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ...systems.numerics.errors import require_type
from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.field.yield_map import known_part, mean_density
from ...systems.numerics.harvest.fleets.figures import FleetFigures, figures_of_plan
from ...systems.numerics.harvest.fleets.fleet_table import FleetTable, fleet_table
from .job import plan_scenario
from .scenario import HarvestScenario

# Combines, carts and trucks of the largest fleet in the table, unless told otherwise.
MOST = (6, 4, 3)

HOUR = 3600.0
# Lines of carts, from one on.
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")
MARKERS = "osD^vP"
KNEE = "black"


@dataclass(frozen=True, eq=False)
class WhatItTakes:
    """The answer to what a harvest would take.

    Attributes:
        scenario: What was asked for.
        field: What is harvested.
        density: Of its crop, on the mean [kg/m^2].
        yields_known: Part of the field of which a file of yields tells; None without one.
        figures: Of the whole plan of the scenario's fleet.
        table: Of fleets side by side; None if it was not asked for.
    """

    scenario: HarvestScenario
    field: Field
    density: float
    yields_known: float | None
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
    require_type("scenario", scenario, HarvestScenario)
    field = scenario.field.load(folder)
    density = scenario.yields.load(field, scenario.density, folder)
    carts = scenario.carts
    trucks = scenario.trucks.fleet(carts.count)
    plan = plan_scenario(scenario, field, density, None, progress)
    figures = figures_of_plan(plan, trucks)
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
            most=most[1:],
            planned={scenario.combines.count: plan.combines},
            progress=progress,
        )
    mean = mean_density(density, field.polygon)
    return WhatItTakes(scenario, field, mean, known_part(density), figures, table)


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
        "yields_known": answer.yields_known,
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


def draw_fleets(table: FleetTable, title: str, area: float) -> Figure:
    """A row of pictures for each number of trucks: times, and what they are made of.

    Args:
        table: What was found.
        title: What is harvested.
        area: Of the field [m^2].
    """
    numbers = sorted({row.trucks for row in table.rows})
    figure = Figure(figsize=(14, 3.9 * len(numbers) + 0.9), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    every = figure.subplots(len(numbers), 2, squeeze=False, width_ratios=[1.0, 1.5])
    knee = table.rows[table.knee]
    top = 1.08 * max(row.makespan for row in table.rows) / HOUR
    for (left, right), trucks in zip(every, numbers, strict=True):
        rows = [row for row in table.rows if row.trucks == trucks]
        _draw_times(left, rows, knee if knee.trucks == trucks else None, top)
        _draw_grid(right, rows, knee if knee.trucks == trucks else None, area)
        if trucks:
            left.set_title(f"{trucks} truck{'s' if trucks > 1 else ''}", loc="left")
    return figure


def _draw_times(
    axes: Axes, rows: list[FleetFigures], knee: FleetFigures | None, top: float
) -> None:
    for k, carts in enumerate(sorted({row.carts for row in rows})):
        own = [row for row in rows if row.carts == carts]
        axes.plot(
            [row.combines for row in own],
            [row.makespan / HOUR for row in own],
            marker=MARKERS[k % len(MARKERS)],
            color=COLOURS[k % len(COLOURS)],
            label=f"{carts} cart{'s' if carts > 1 else ''}",
        )
    if knee is not None:
        axes.plot(
            knee.combines, knee.makespan / HOUR, "o", markersize=18, markerfacecolor="none",
            markeredgecolor=KNEE, markeredgewidth=2.0,
        )  # fmt: skip
        # On the side where there is more room.
        numbers = [row.combines for row in rows]
        left = 2 * knee.combines > min(numbers) + max(numbers)
        axes.annotate(
            f"knee: {_fleet(knee)}",
            (knee.combines, knee.makespan / HOUR),
            (-14 if left else 14, 16),
            textcoords="offset points",
            horizontalalignment="right" if left else "left",
            fontsize="small",
        )
    axes.set_xticks(sorted({row.combines for row in rows}))
    axes.set_ylim(0, top)
    axes.set_xlabel("combines")
    axes.set_ylabel("until all is done [h]")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize="small")


def _draw_grid(
    axes: Axes, rows: list[FleetFigures], knee: FleetFigures | None, area: float
) -> None:
    """A cell for each fleet: time, engine hours, fuel for a hectare, combines' standing."""
    across = sorted({row.combines for row in rows})
    down = sorted({row.carts for row in rows})
    standing = np.full((len(down), len(across)), np.nan)
    for row in rows:
        part = row.combines_for_carts / row.combine_engine_time
        standing[down.index(row.carts), across.index(row.combines)] = part
    axes.imshow(standing, cmap="Reds", vmin=0.0, vmax=0.5, aspect="auto")
    for row in rows:
        x, y = across.index(row.combines), down.index(row.carts)
        said = f"{row.makespan / HOUR:.2f} h\n{row.engine_hours:.1f} engine h\n"
        said += f"{row.fuel / (area / 1e4):.1f} l/ha\n"
        said += f"{row.combines_for_carts / row.combine_engine_time:.0%} stood"
        axes.text(x, y, said, ha="center", va="center", fontsize=8)
    if knee is not None:
        x, y = across.index(knee.combines), down.index(knee.carts)
        axes.add_patch(
            Rectangle((x - 0.48, y - 0.48), 0.96, 0.96, fill=False, edgecolor=KNEE, linewidth=2.5)
        )
    axes.set_xticks(range(len(across)), [str(n) for n in across])
    axes.set_yticks(range(len(down)), [str(k) for k in down])
    axes.set_xlabel("combines")
    axes.set_ylabel("carts")
    said = "red: part of their time that combines stand full; framed: the knee"
    axes.set_title(said, fontsize="small", loc="right")


def _fleet(row: FleetFigures) -> str:
    said = f"{row.combines} combine{'s' if row.combines > 1 else ''}"
    return f"{said}, {row.carts} cart{'s' if row.carts > 1 else ''}"

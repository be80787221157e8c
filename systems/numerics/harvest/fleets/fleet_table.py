"""Fleets of all sizes side by side, and the one beyond which more machines hardly pay."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InvalidInput, require
from ..field.field import Field
from ..field.yield_map import YieldMap
from ..machines import Cart, Combine
from ..plan.harvest_plan import CombinePlan, plan_combines, tank_reach, truck_places
from ..trucks import TruckFleet
from .cart_rounds import run_carts, work_ahead
from .figures import FleetFigures, figures_of_model


@dataclass(frozen=True)
class FleetTable:
    """Fleets side by side.

    Attributes:
        rows: One for each fleet that can do it, in order of combines, carts and trucks.
        knee: Number of the row of the knee; see `knee_of`.
        refused: For each fleet that cannot: its number of combines, its number of carts (0: any),
            and why.
    """

    rows: tuple[FleetFigures, ...]
    knee: int
    refused: tuple[tuple[int, int, str], ...]

    def row(self, combines: int, carts: int, trucks: int) -> FleetFigures | None:
        """A fleet's row, if it has one.

        Args:
            combines, carts, trucks: How many there are.
        """
        size = (combines, carts, trucks)
        return next((r for r in self.rows if (r.combines, r.carts, r.trucks) == size), None)


def fleet_table(
    field: Field,
    combines: Sequence[Combine],
    cart: Cart,
    trucks: TruckFleet,
    *,
    density: float | YieldMap,
    truck_rate: float,
    threshold: float = 0.5,
    pattern: str = "lands",
    seed: int = 0,
    most: tuple[int, int] = (4, 3),
    planned: Mapping[int, CombinePlan] | None = None,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> FleetTable:
    """Plan the combines of each fleet, and serve them by the model of carts.

    An additional cart or truck may stay unused: where a smaller fleet with as many combines is
    quicker, the larger one is given its figures.

    Args:
        field: What is harvested.
        combines: The largest team, all of one size; smaller teams are the first of them.
        cart: One of the equal carts.
        trucks: What takes the grain; if they hold any amount, there is one for each cart, and they
            are not counted.
        density: Of the crop [kg/m^2].
        truck_rate: Rate at which carts are emptied [kg/s].
        threshold: Part of a tank that has to be filled before a cart comes.
        pattern: Of the combines' paths; see `find_coverages`.
        seed: Random seed of the orders that are tried.
        most: Largest numbers of carts and of trucks that are tried.
        planned: Plans that exist already, by their numbers of combines.
        progress: Called with what is being done and the share that is done, in [0, 1].

    Raises:
        InvalidInput: A value is out of its range, or no fleet can do it.
    """
    require(min(most) >= 1, "most", "be at least 1 of each", most)
    rows: list[FleetFigures] = []
    refused: list[tuple[int, int, str]] = []
    counts = np.isfinite(trucks.capacity)
    sizes = range(1, most[1] + 1) if counts else [0]
    for count in range(1, len(combines) + 1):
        progress(f"{count} combines", (count - 1) / len(combines))
        try:
            team = (planned or {}).get(count)
            if team is None:
                crew = combines[:count]
                reach = tank_reach(field, crew, density)
                team = plan_combines(field, crew, pattern=pattern, seed=seed, reach=reach)
        except InvalidInput as error:
            refused.append((count, 0, str(error)))
            continue
        work = work_ahead(team, density)
        best: dict[tuple[int, int], FleetFigures] = {}
        for carts in range(1, most[0] + 1):
            try:
                places = truck_places(team, cart, carts)[:, :2]
            except InvalidInput as error:
                refused.append((count, carts, str(error)))
                continue
            for number in sizes:
                some = replace(trucks, count=number if counts else carts)
                rounds = run_carts(
                    work, combines[:count], cart, places, some, truck_rate, threshold
                )
                row = figures_of_model(team, cart, rounds, some)
                less = [best.get((carts - 1, number)), best.get((carts, number - 1))]
                better = [each for each in less if each and each.makespan < row.makespan]
                if better:
                    least = min(better, key=lambda each: each.makespan)
                    row = replace(least, carts=carts, trucks=number)
                best[carts, number] = row
                rows.append(row)
    if not rows:
        raise InvalidInput(f"`combines` must be able to cut the field; got none: {refused[0][2]}")
    return FleetTable(tuple(rows), knee_of(rows), tuple(refused))


def knee_of(rows: list[FleetFigures]) -> int:
    """The knee: the fleet beyond which one more machine saves less time than on average.

    Take the quickest fleet for each number of machines, if it is quicker than all smaller ones. The
    knee is the one of these that is farthest below the straight line from the first to the last of
    them, with both axes scaled to their ranges.

    Args:
        rows: At least one.

    Returns:
        Number of the row.
    """
    order = sorted(range(len(rows)), key=lambda k: (rows[k].machines, rows[k].makespan))
    front: list[int] = []
    for k in order:
        if not front or rows[k].makespan < rows[front[-1]].makespan - 1e-9:
            if front and rows[k].machines == rows[front[-1]].machines:
                continue
            front.append(k)
    if len(front) < 3:
        return front[-1]
    machines = np.array([rows[k].machines for k in front], dtype=float)
    times = np.array([rows[k].makespan for k in front])
    across = (machines - machines[0]) / (machines[-1] - machines[0])
    down = (times - times[-1]) / (times[0] - times[-1])
    return front[int(np.argmax(1.0 - across - down))]

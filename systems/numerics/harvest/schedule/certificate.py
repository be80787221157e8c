"""Why a fleet has no schedule, and how certain that is."""

import math
from dataclasses import dataclass
from enum import Enum

from .best_visits import BestVisits
from .certain_limit import certain_limit
from .fleet import Fleet, Truck


class Holds(Enum):
    """For whom a certificate holds."""

    ANY = "whatever carts do"
    ORDERS = "for every order of visits that empty the tanks"
    SEARCHED = "for the visits that were searched"


@dataclass(frozen=True)
class InfeasibilityCertificate:
    """What there is too little of.

    Attributes:
        resource: "unload_rate" (augers are too slow for the carts' time) or "travel_time".
        limit: The largest factor on all ways with which a schedule could still be had; 0: none.
        holds: For which strategies.
    """

    resource: str
    limit: float
    holds: Holds

    @property
    def says(self) -> str:
        """The certificate as a sentence."""
        if self.resource == "unload_rate":
            return f"unloading takes more time than the carts have, {self.holds.value}"
        most = (
            "none of their time" if self.limit <= 0 else f"at most {self.limit:.4g} of their time"
        )
        return f"ways would have to take {most}, {self.holds.value}"


def certify_infeasible(
    fleet: Fleet, carts: int, truck: Truck | None, groups: list[BestVisits]
) -> InfeasibilityCertificate:
    """The strongest reason why there is no schedule.

    Args:
        fleet: The combines.
        carts: How many there are.
        truck: Where carts unload, if anywhere.
        groups: What each cart can do at best for its combines.
    """
    limit = certain_limit(fleet, carts, truck)
    if limit == 0.0:
        return InfeasibilityCertificate("unload_rate", 0.0, Holds.ANY)
    if limit < 1.0:
        return InfeasibilityCertificate("travel_time", limit, Holds.ANY)
    if carts == 1 and groups[0].bound <= 1.0:
        return InfeasibilityCertificate("travel_time", groups[0].bound, Holds.ORDERS)
    found = min(group.scale for group in groups)
    return InfeasibilityCertificate(
        "travel_time", max(found, 0.0) if math.isfinite(found) else 0.0, Holds.SEARCHED
    )

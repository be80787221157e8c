"""What a harvest is made of: field, combines, carts, strategy, clock."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from pydantic import ConfigDict

from ...systems.numerics.errors import (
    require,
    require_non_negative,
    require_one_of,
    require_positive,
)
from ...systems.numerics.harvest.coverage.plan_coverage import PATTERNS
from ...systems.numerics.harvest.execution.disturbance import Disturbance
from ...systems.numerics.harvest.field.field import MARGIN, Field
from ...systems.numerics.harvest.field.field_files import read_field
from ...systems.numerics.harvest.machines.cart import Cart
from ...systems.numerics.harvest.machines.combine import Combine
from ..scenario_files import NO_OTHER_KEYS

STRATEGIES = ("sequential", "on-demand")


@dataclass(frozen=True, kw_only=True)
class FieldSource:
    """A rectangle, or a boundary from a file.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # Sides of a rectangle [m].
    width: float = 0.0
    height: float = 0.0
    # Instead: a file, WKT or GeoJSON; relative to the scenario's folder.
    file: str = ""
    # Of a file: "wgs84" for longitude and latitude [deg], or "metres".
    coordinates: str = "wgs84"
    # Width of the strip outside of the boundary that may be driven on [m].
    margin: float = MARGIN

    def __post_init__(self) -> None:
        require_one_of("coordinates", self.coordinates, ("metres", "wgs84"))
        require_non_negative("margin", self.margin)
        if not self.file:
            require_positive("width", self.width)
            require_positive("height", self.height)

    def load(self, folder: Path = Path()) -> Field:
        """Make the field.

        Raises:
            InvalidInput: The file holds no field.
        """
        if not self.file:
            return Field.rectangle(self.width, self.height, margin=self.margin)
        return read_field(folder / self.file, coordinates=self.coordinates, margin=self.margin)


@dataclass(frozen=True, kw_only=True)
class Combines(Combine):
    """The team that cuts.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # Number of combines.
    count: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.count >= 1, "count", "be at least 1", self.count)


@dataclass(frozen=True, kw_only=True)
class Carts(Cart):
    """The carts that carry.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # Number of carts.
    count: int = 1
    # At which a cart is emptied into its truck [kg/s].
    truck_rate: float = 300.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.count >= 1, "count", "be at least 1", self.count)
        require_positive("truck_rate", self.truck_rate)


@dataclass(frozen=True, kw_only=True)
class Disturbances(Disturbance):
    """What goes wrong on the way.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS


@dataclass(frozen=True, kw_only=True)
class HarvestScenario:
    """A field to be harvested.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # Where.
    field: FieldSource
    # Grain on the field [kg/m^2].
    density: float = 0.8
    # Who cuts.
    combines: Combines = dataclasses.field(default_factory=Combines)
    # Who carries.
    carts: Carts = dataclasses.field(default_factory=Carts)
    # "sequential" (3.4) or "on-demand".
    strategy: str = "sequential"
    # Part of a tank from which on a cart comes.
    threshold: float = 0.5
    # Of the combines' paths: "lands", rounds in arcs, then a land of swaths for each; or "thesis",
    # rows from the perimeter inwards, combines on adjacent ones.
    pattern: str = "lands"
    # For the schedule: part of each tank that is filled, so that a cart may come late.
    fill: float = 0.6
    # For the schedule: the cart's way from each combine to the next [s]; null: from the field.
    travel_time: float | None = None
    # Time step [s].
    period: float = 0.25
    # The run ends then at the latest [h].
    hours: float = 12.0
    # What goes wrong on the way.
    disturbance: Disturbances = dataclasses.field(default_factory=Disturbances)
    # Of the orders of combines that are tried.
    seed: int = 0

    def __post_init__(self) -> None:
        require_positive("density", self.density)
        require_one_of("strategy", self.strategy, STRATEGIES)
        require_one_of("pattern", self.pattern, PATTERNS)
        require(0 < self.threshold <= 1, "threshold", "lie above 0 and up to 1", self.threshold)
        require(0 < self.fill <= 1, "fill", "lie above 0 and up to 1", self.fill)
        if self.travel_time is not None:
            require_non_negative("travel_time", self.travel_time)
        require_positive("period", self.period)
        require(self.period <= 0.5, "period", "be at most 0.5 s", self.period)
        require_positive("hours", self.hours)
        require_non_negative("seed", self.seed)

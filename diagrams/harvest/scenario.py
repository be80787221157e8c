"""What a harvest is made of: field, combines, carts, strategy, clock."""

import dataclasses
import math
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from ...systems.numerics.errors import (
    require,
    require_finite,
    require_non_negative,
    require_one_of,
    require_positive,
)
from ...systems.numerics.harvest.carts.visit_choice import STRATEGIES
from ...systems.numerics.harvest.carts.visits import VISITS
from ...systems.numerics.harvest.coverage.plan_coverage import PATTERNS
from ...systems.numerics.harvest.execution.advance import Disturbance
from ...systems.numerics.harvest.field.field import MARGIN, Field, Place
from ...systems.numerics.harvest.field.field_files import read_field
from ...systems.numerics.harvest.field.yield_map import YieldMap, mean_density, read_yields
from ...systems.numerics.harvest.machines import Cart, Combine
from ...systems.numerics.harvest.trucks import TruckFleet
from ...systems.numerics.units import (
    Hours,
    Kilograms,
    KilogramsPerSecond,
    KilogramsPerSquareMetre,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    Seconds,
    Watts,
    area_text,
)
from .makers import with_makers_figures

# Larger fields are not planned in one [m], [m^2].
LONGEST, LARGEST = 1e4, 1e7
# No field has a wider strip round it that may be driven on [m].
WIDEST_MARGIN = 200.0
# Slower machines [m/s], [m/s^2], and those that turn on the spot [m], would be planned for days.
SLOWEST = {"speed": 0.1, "acceleration": 0.05, "turning_radius": 0.5}
# No field has more combines or carts.
MOST_MACHINES = 100


@dataclass(frozen=True, kw_only=True)
class FieldSource:
    """A rectangle, or a boundary from a file.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Side of a rectangle from west to east [m].
    width: Metres = 0.0
    # From south to north [m].
    height: Metres = 0.0
    # Instead: a file, WKT, GeoJSON, Shapefile or ISO 11783 task data; relative to the scenario's
    # folder.
    file: str = ""
    # Of a file: "wgs84" for longitude and latitude [deg], or "metres".
    coordinates: str = "wgs84"
    # Width of the strip outside of the boundary that may be driven on [m].
    margin: Metres = MARGIN
    # Of a file with several parts, which one, from 1; 0: the only one.
    part: int = 0
    # Another file with areas that nothing drives on, in the same coordinates; or empty.
    no_go: str = ""
    # Where the field is entered, besides gates of the file and in its coordinates.
    gates: tuple[tuple[float, float], ...] = ()
    # Likewise, where trucks may stand; without any they stand on the margin, as near to gates as
    # there is room.
    trucks: tuple[tuple[float, float], ...] = ()
    # Of a field in metres: longitude and latitude of its zero [deg]; null: nobody knows.
    origin: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        require_one_of("coordinates", self.coordinates, ("metres", "wgs84"))
        require_non_negative("margin", self.margin)
        most = f"be at most {WIDEST_MARGIN:g} m"
        require(self.margin <= WIDEST_MARGIN, "margin", most, self.margin)
        for name, points in (("gates", self.gates), ("trucks", self.trucks)):
            for value in (each for point in points for each in point):
                require_finite(name, value)
        if not self.file:
            for name in ("coordinates", "part", "no_go"):
                _require_file(self, name)
            require_positive("width", self.width)
            require_positive("height", self.height)

    def load(self, folder: Path = Path()) -> Field:
        """Make the field.

        Raises:
            InvalidInput: The file holds no field, or one that is too large.
        """
        if not self.file:
            field = Field.rectangle(self.width, self.height, margin=self.margin)
            field = replace(field, gates=_points(self.gates), trucks=_points(self.trucks))
        else:
            field = read_field(
                folder / self.file,
                coordinates=self.coordinates,
                margin=self.margin,
                part=self.part,
                no_go=folder / self.no_go if self.no_go else "",
                gates=self.gates,
                trucks=self.trucks,
            )
        x_low, y_low, x_high, y_high = field.outline.bounds
        extent = max(x_high - x_low, y_high - y_low)
        require(extent <= LONGEST, "field", f"be at most {LONGEST / 1e3:g} km long", extent)
        area = field.outline.area
        largest = f"have at most {area_text(LARGEST)}"
        require(area <= LARGEST, "field", largest, area_text(area))
        if self.origin is not None:
            metres = not field.place.geographic
            require(metres, "origin", "be of a field in metres", self.origin)
            field = replace(field, place=Place(origin=self.origin))
        return field


def _require_quick(machine: "Combine | Cart | OneCombine") -> None:
    for key, least in SLOWEST.items():
        value = getattr(machine, key, None)
        require(value is None or value >= least, key, f"be at least {least:g}", value)


def _require_file(source: "FieldSource | Yields", name: str) -> None:
    """Refuse what says how a file is to be read, where there is none."""
    came = getattr(source, name)
    require(came == getattr(type(source), name), name, "come with a file", came)


def _points(points: tuple[tuple[float, float], ...]) -> np.ndarray:
    return np.array(points, dtype=float).reshape(-1, 2)


@dataclass(frozen=True, kw_only=True)
class Yields:
    """What grows where.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # GeoJSON with a yield for each polygon or an ESRI ASCII grid, in coordinates as the field's;
    # relative to the scenario's folder; empty: as dense everywhere.
    file: str = ""
    # Name of the polygons' property.
    property: str = "yield"
    # Of the file's numbers.
    unit: str = "t/ha"
    # All of it is multiplied by this, no unit.
    factor: float = 1.0

    def __post_init__(self) -> None:
        require_positive("factor", self.factor)
        require_finite("factor", self.factor)
        if not self.file:
            for name in ("property", "unit"):
                _require_file(self, name)

    def load(
        self, field: Field, density: float | YieldMap, folder: Path = Path()
    ) -> float | YieldMap:
        """Read what grows where [kg/m^2].

        Args:
            field: Where.
            density: What grows where the file says nothing [kg/m^2]; its mean, where it is a map.
            folder: Where the file is looked for.

        Raises:
            InvalidInput: The file cannot be read, or holds no yields of the field.
        """
        if self.file:
            mean = mean_density(density, field.polygon)
            path = folder / self.file
            density = read_yields(path, field, mean, key=self.property, unit=self.unit)
        if isinstance(density, YieldMap):
            return replace(density, values=self.factor * density.values)
        return self.factor * density


@dataclass(frozen=True, kw_only=True)
class OneCombine:
    """What one combine has otherwise than its team; null: as the others.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Speed, forwards and backwards [m/s].
    speed: MetresPerSecond | None = None
    # Largest, speeding up and slowing down [m/s^2].
    acceleration: MetresPerSecondSquared | None = None
    # Tank [kg].
    capacity: Kilograms | None = None
    # What the auger delivers [kg/s].
    unload_rate: KilogramsPerSecond | None = None
    # Of the engine, for its fuel [W].
    engine_power: Watts | None = None
    # Of the machine with an empty tank [kg].
    mass: Kilograms | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None:
                require_positive(name, value)
        _require_quick(self)


@with_makers_figures("combines")
@dataclass(frozen=True, kw_only=True)
class Combines(Combine):
    """The team that cuts.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Of a maker, by its name in the catalogue; see `makers`. What is said besides holds.
    machine: str = ""
    # Number of combines.
    count: int = 2
    # What single ones have otherwise, in their order; the others are as is said above.
    each: tuple[OneCombine, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.count >= 1, "count", "be at least 1", self.count)
        require(self.count <= MOST_MACHINES, "count", f"be at most {MOST_MACHINES}", self.count)
        said = len(self.each)
        require(said <= self.count, "each", f"tell of {self.count} combines at most", said)
        _require_quick(self)

    def machines(self, count: int | None = None) -> tuple[Combine, ...]:
        """The combines of the team, or of one of another number, shape (count,)."""
        alike = Combine(**{each.name: getattr(self, each.name) for each in fields(Combine)})
        team = [alike] * (self.count if count is None else count)
        for n, other in enumerate(self.each[: len(team)]):
            told = {name: value for name, value in vars(other).items() if value is not None}
            team[n] = replace(alike, **told)
        return tuple(team)


@with_makers_figures("carts")
@dataclass(frozen=True, kw_only=True)
class Carts(Cart):
    """The carts that carry.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Of a maker, by its name in the catalogue; see `makers`. What is said besides holds.
    machine: str = ""
    # Number of carts.
    count: int = 1
    # At which a cart is emptied into its truck [kg/s].
    truck_rate: KilogramsPerSecond = 300.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.count >= 1, "count", "be at least 1", self.count)
        require(self.count <= MOST_MACHINES, "count", f"be at most {MOST_MACHINES}", self.count)
        require_positive("truck_rate", self.truck_rate)
        _require_quick(self)


@dataclass(frozen=True, kw_only=True)
class Trucks:
    """The trucks that take the grain away.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # How many there are; null: one for each cart.
    count: int | None = None
    # What one holds; infinite: any amount, so that none ever leaves [kg].
    capacity: Kilograms = math.inf
    # From leaving the field, full, to being back, empty [s].
    road_time: Seconds = 0.0

    def __post_init__(self) -> None:
        fleet = self.fleet(carts=1)
        require(fleet.count <= MOST_MACHINES, "count", f"be at most {MOST_MACHINES}", self.count)

    def fleet(self, carts: int) -> TruckFleet:
        """The trucks as plans need them.

        Args:
            carts: How many there are.

        Raises:
            InvalidInput: A value is out of its range.
        """
        count = carts if self.count is None else self.count
        return TruckFleet(count=count, capacity=self.capacity, road_time=self.road_time)


@dataclass(frozen=True, kw_only=True)
class Disturbances(Disturbance):
    """What goes wrong on the way.

    Raises:
        InvalidInput: A value is out of its range.
    """


@dataclass(frozen=True, kw_only=True)
class HarvestScenario:
    """A field to be harvested.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Where.
    field: FieldSource
    # Grain on the field [kg/m^2].
    density: KilogramsPerSquareMetre = 0.8
    # Where more of it grows, where less.
    yields: Yields = dataclasses.field(default_factory=Yields)
    # What grows in fact, of which the plan knows nothing; null: what is planned with.
    grown: Yields | None = None
    # Part of each tank and cart that the plan leaves free, for more grain than it knows of.
    reserve: float = 0.0
    # Who cuts.
    combines: Combines = dataclasses.field(default_factory=Combines)
    # Who carries.
    carts: Carts = dataclasses.field(default_factory=Carts)
    # Who takes the grain away.
    trucks: Trucks = dataclasses.field(default_factory=Trucks)
    # "sequential" (3.4) or "on-demand".
    strategy: str = "sequential"
    # Part of a tank from which on a cart comes.
    threshold: float = 0.5
    # "revised": visits are given up for others where a combine would have to wait; "greedy": never.
    visits: str = "revised"
    # Of the combines' paths: "lands", rounds in arcs, then a land of swaths for each; or "thesis",
    # rows from the perimeter inwards, combines on adjacent ones.
    pattern: str = "lands"
    # For the schedule: part of each tank that is filled, so that a cart may come late.
    fill: float = 0.6
    # For the schedule: the cart's way from each combine to the next [s]; null: from the field.
    travel_time: Seconds | None = None
    # Time step [s].
    period: Seconds = 0.25
    # The run ends then at the latest [h].
    hours: Hours = 12.0
    # What goes wrong on the way.
    disturbance: Disturbances = dataclasses.field(default_factory=Disturbances)
    # Of the orders of combines that are tried.
    seed: int = 0

    def __post_init__(self) -> None:
        require_positive("density", self.density)
        require(0 <= self.reserve <= 0.9, "reserve", "lie from 0 to 0.9", self.reserve)
        require_one_of("strategy", self.strategy, STRATEGIES)
        require_one_of("pattern", self.pattern, PATTERNS)
        require_one_of("visits", self.visits, VISITS)
        require(0 < self.threshold <= 1, "threshold", "lie above 0 and up to 1", self.threshold)
        require(0 < self.fill <= 1, "fill", "lie above 0 and up to 1", self.fill)
        if self.travel_time is not None:
            require_non_negative("travel_time", self.travel_time)
        require_finite("period", self.period)
        require(0.01 <= self.period <= 0.5, "period", "be from 0.01 to 0.5 s", self.period)
        require_positive("hours", self.hours)
        require_non_negative("seed", self.seed)

    def planned_combines(self, count: int | None = None) -> tuple[Combine, ...]:
        """The combines as plans have them, with less room in their tanks than there is.

        Args:
            count: Of another team; None: of this.
        """
        room = 1.0 - self.reserve
        team = self.combines.machines(count)
        return tuple(replace(combine, capacity=room * combine.capacity) for combine in team)

    @property
    def planned_cart(self) -> Carts:
        """A cart likewise."""
        return replace(self.carts, capacity=(1.0 - self.reserve) * self.carts.capacity)

"""Where a scenario's world comes from: its own rings, or a file."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from ..systems.numerics.errors import require, require_one_of
from ..systems.numerics.geometry.occupancy_outline import OutlineOptions
from ..systems.numerics.geometry.world import World, make_world
from ..systems.numerics.geometry.world_files import load_world


@dataclass(frozen=True, kw_only=True)
class WorldSource:
    """A free region with holes.

    Raises:
        InvalidInput: Neither rings nor a file are given, or both; an option is out of its range.
    """

    # Outer ring, [[x, y], ...] [m]; may be non-convex.
    boundary: list[list[float]] = field(default_factory=list)
    # Polygonal obstacles, a ring each [m].
    obstacles: list[list[list[float]]] = field(default_factory=list)
    # Instead: a file, WKT, GeoJSON or the YAML of a ROS map; relative to the scenario's folder.
    file: str = ""
    # Of a WKT or GeoJSON file: "metres", or "wgs84" for longitude and latitude [deg].
    coordinates: str = "metres"
    # Of a ROS map: what cells of unknown occupancy are, "occupied" or "free".
    unknown: str = "occupied"
    # Of a ROS map: smaller obstacles are speckle and dropped [m^2].
    min_obstacle_area: float = OutlineOptions().min_obstacle_area
    # Of a ROS map: a slender obstacle at least this long is a wall, and kept [m].
    min_wall_length: float = OutlineOptions().min_wall_length
    # Of a ROS map: how far simplified outlines may be from the cells' [m]; null: a cell.
    tolerance: float | None = OutlineOptions().tolerance

    def __post_init__(self) -> None:
        require(
            bool(self.boundary) != bool(self.file),
            "boundary",
            "be given, or `file` instead of it",
            "both" if self.file else "neither",
        )
        require_one_of("coordinates", self.coordinates, ("metres", "wgs84"))
        self.outline_options()

    def beside(self, folder: Path) -> "WorldSource":
        """The same source, its file looked up relative to a folder."""
        return replace(self, file=str(folder / self.file)) if self.file else self

    def load(self) -> World:
        """Make the world.

        Raises:
            InvalidInput: The rings or the file bound no free region.
        """
        if not self.file:
            return make_world(self.boundary, self.obstacles)
        options = self.outline_options()
        return load_world(Path(self.file), options=options, coordinates=self.coordinates).world

    def outline_options(self) -> OutlineOptions:
        """How the cells of a ROS map become outlines."""
        return OutlineOptions(
            unknown=self.unknown,
            min_obstacle_area=self.min_obstacle_area,
            min_wall_length=self.min_wall_length,
            tolerance=self.tolerance,
        )

"""A field: its boundary, the obstacles in it, the strip round it, and where on Earth it lies."""

from dataclasses import dataclass
from dataclasses import field as attribute
from functools import cached_property

import numpy as np
import shapely

from ...errors import require, require_finite, require_non_negative, require_positive
from ...geometry.world import World, begin_leftmost, make_world
from ...geometry.world_files import from_local_plane, local_plane

# Width of the strip outside of the boundary, unless told otherwise [m].
MARGIN = 12.0
# Gates and trucks farther than this from the origin of a field's coordinates are rejected [m].
FARTHEST_PLACE = 200e3


@dataclass(frozen=True)
class Place:
    """Where the origin of a field's coordinates in metres lies.

    Attributes:
        origin: Its longitude and latitude (WGS 84), x is east and y north of it; None: it is not
            known where the field lies [degrees].
        offset: If that is not known, the origin's coordinates in the field's file [m].

    Raises:
        InvalidInput: The origin is not on the globe, or at a pole.
    """

    origin: tuple[float, float] | None = None
    offset: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.origin is not None:
            for value in self.origin:
                require_finite("origin", value)
            fits = abs(self.origin[0]) <= 180 and abs(self.origin[1]) < 89
            require(fits, "origin", "be a longitude and a latitude in degrees", self.origin)

    @property
    def geographic(self) -> bool:
        """Whether it is known where the field lies."""
        return self.origin is not None

    def outwards(self, points: np.ndarray) -> np.ndarray:
        """Points of the field in the coordinates of its file.

        Args:
            points: Shape (n, 2) [m].

        Returns:
            Longitude and latitude, shape (n, 2) [degrees], or metres.
        """
        points = np.asarray(points, dtype=float)
        if self.origin is None:
            return points + np.array(self.offset)
        return from_local_plane(points, np.array(self.origin))

    def inwards(self, points: np.ndarray) -> np.ndarray:
        """Points of a file in the field's metres; the inverse of `outwards`.

        Args:
            points: Longitude and latitude, shape (n, 2) [degrees], or metres.

        Returns:
            Shape (n, 2) [m].
        """
        points = np.asarray(points, dtype=float)
        if self.origin is None:
            return points - np.array(self.offset)
        return local_plane(points, np.array(self.origin))


@dataclass(frozen=True, eq=False)
class Field:
    """A field of one uniform crop.

    Attributes:
        world: The crop's region; its obstacles are places without crop that nothing drives on.
            Rings begin at their leftmost corners, so that a plan does not depend on where
            the drawing of the field began.
        margin: Width of the strip outside of the boundary on which combines may turn and the cart
            may drive [m].
        no_go: Polygons beyond the crop that nothing drives on, on the margin for instance.
        gates: Where the field is entered, shape (g, 2) [m].
        trucks: Where trucks may stand, shape (t, 2); none: anywhere on the margin [m].
        place: Where it lies on Earth.
        name: Of the field in its file, or empty.

    Raises:
        InvalidInput: The margin is negative, or a gate or a truck's place is far from the field.
    """

    world: World
    margin: float = MARGIN
    no_go: tuple[shapely.Polygon, ...] = ()
    gates: np.ndarray = attribute(default_factory=lambda: np.zeros((0, 2)))
    trucks: np.ndarray = attribute(default_factory=lambda: np.zeros((0, 2)))
    place: Place = Place()
    name: str = ""

    def __post_init__(self) -> None:
        require_non_negative("margin", self.margin)
        object.__setattr__(self, "world", begin_leftmost(self.world))
        for name in ("gates", "trucks"):
            places = getattr(self, name)
            near = bool((np.abs(places) <= FARTHEST_PLACE).all())
            what = f"lie within {FARTHEST_PLACE / 1e3:g} km of the field"
            require(near, name, what, f"{np.round(places, 1).tolist()} m")

    @classmethod
    def rectangle(cls, width: float, height: float, *, margin: float = MARGIN) -> "Field":
        """A field from (0, 0) to (width, height) [m].

        Raises:
            InvalidInput: A side is not positive, or the margin is negative.
        """
        require_positive("width", width)
        require_positive("height", height)
        return cls(make_world([(0, 0), (width, 0), (width, height), (0, height)]), margin)

    @property
    def polygon(self) -> shapely.Polygon:
        """Where the crop grows."""
        return self.world.polygon

    @property
    def area(self) -> float:
        """Area of the crop [m^2]."""
        return self.world.free_area

    @cached_property
    def outline(self) -> shapely.Polygon:
        """The field with its obstacles filled."""
        return shapely.Polygon(self.world.boundary)

    @cached_property
    def obstacles(self) -> tuple[shapely.Polygon, ...]:
        """The obstacles as polygons."""
        return tuple(shapely.Polygon(ring) for ring in self.world.obstacles)

    @cached_property
    def ground(self) -> shapely.Polygon:
        """Everything that may be driven on, once the crop is cut: the field with its margin.

        The margin has the same width at corners, which it rounds.
        Bits of the margin that a no-go area cuts off from the field are left out.
        """
        wide = self.outline.buffer(self.margin)
        ground = wide.difference(shapely.union_all([*self.obstacles, *self.no_go]))
        reached = [part for part in shapely.get_parts(ground) if part.intersects(self.polygon)]
        return max(reached, key=lambda part: part.intersection(self.polygon).area)

"""A field: its boundary, the obstacles in it, and the strip round it that may be driven on."""

from dataclasses import dataclass
from dataclasses import field as attribute
from functools import cached_property

import numpy as np
import shapely

from ...errors import require_non_negative, require_positive
from ...geometry.world import World, make_world
from .place import Place

# Width of the strip outside of the boundary, unless told otherwise [m].
MARGIN = 12.0


@dataclass(frozen=True, eq=False)
class Field:
    """A field of one uniform crop.

    Attributes:
        world: The crop's region; its obstacles are places without crop that nothing drives on.
        margin: Width of the strip outside of the boundary on which combines may turn and the cart
            may drive [m].
        no_go: Polygons beyond the crop that nothing drives on, on the margin for instance.
        gates: Where the field is entered, shape (g, 2) [m].
        trucks: Where trucks may stand, shape (t, 2); none: anywhere on the margin [m].
        place: Where it lies on Earth.
        name: Of the field in its file, or empty.

    Raises:
        InvalidInput: The margin is negative.
    """

    world: World
    margin: float = MARGIN
    no_go: tuple[shapely.Polygon, ...] = ()
    gates: np.ndarray = attribute(default_factory=lambda: np.zeros((0, 2)))
    trucks: np.ndarray = attribute(default_factory=lambda: np.zeros((0, 2)))
    place: Place = Place()  # noqa: RUF009  # It is frozen.
    name: str = ""

    def __post_init__(self) -> None:
        require_non_negative("margin", self.margin)

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

        The margin is as wide as it is at corners too, which it rounds.
        Bits of the margin that a no-go area cuts off from the field are left out.
        """
        wide = self.outline.buffer(self.margin)
        ground = wide.difference(shapely.union_all([*self.obstacles, *self.no_go]))
        reached = [part for part in shapely.get_parts(ground) if part.intersects(self.polygon)]
        return max(reached, key=lambda part: part.intersection(self.polygon).area)

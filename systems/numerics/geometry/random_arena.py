"""Square arenas with rectangular obstacles at random places.

Source: Zhang 2014, 2.2.7 ("a 4000 x 4000 environment with rectangular obstacles"); the thesis does
not say how many, how large or where.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import InvalidInput, require, require_non_negative, require_positive
from .world import World, make_world

# Draws for one obstacle before all are drawn again, and how often that is tried.
_DRAWS = 200
_ATTEMPTS = 50


@dataclass(frozen=True, kw_only=True)
class Arena:
    """How arenas are drawn.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Side of the square [m].
    side: float = 4.0
    # Number of rectangles.
    obstacles: int = 5
    # Their sides are drawn uniformly from this length on [m].
    shortest: float = 0.4
    # Up to this one [m].
    longest: float = 0.9
    # Least distance between rectangles, and from rectangles to the walls [m].
    gap: float = 0.3

    def __post_init__(self) -> None:
        for name in ("side", "shortest", "longest"):
            require_positive(f"arena.{name}", getattr(self, name))
        require_non_negative("arena.gap", self.gap)
        require(self.obstacles >= 0, "arena.obstacles", "be zero or positive", self.obstacles)
        require(
            self.shortest <= self.longest,
            "arena.longest",
            f"be at least `arena.shortest`, which is {self.shortest}",
            self.longest,
        )
        require(
            self.longest + 2.0 * self.gap <= self.side,
            "arena.longest",
            f"fit between walls {self.side} m apart with gaps of {self.gap} m",
            self.longest,
        )


def draw_arena(arena: Arena, seed: int) -> World:
    """Draw a world.

    Rectangles are parallel to the walls. Each is placed uniformly in the room that earlier ones
    leave; if no place is found, all are drawn again.

    Args:
        arena: Sizes and number of the obstacles.
        seed: Same seed, same world. The stream differs from that of `np.random.default_rng(seed)`.

    Raises:
        InvalidInput: There is no room for the obstacles.
    """
    require(seed >= 0, "seed", "be zero or positive", seed)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,)))
    for _ in range(_ATTEMPTS):
        boxes = _draw_boxes(arena, rng)
        if boxes is not None:
            side = arena.side
            rings = [[[a, b], [c, b], [c, d], [a, d]] for a, b, c, d in boxes.tolist()]
            return make_world([[0, 0], [side, 0], [side, side], [0, side]], rings)
    raise InvalidInput(
        f"`arena.obstacles` must find room, {arena.gap} m apart, in a square of {arena.side} m; "
        f"got {arena.obstacles} with sides of {arena.shortest} to {arena.longest} m"
    )


def _draw_boxes(arena: Arena, rng: np.random.Generator) -> np.ndarray | None:
    """Boxes x_min, y_min, x_max, y_max, shape (n, 4) [m], or None when one finds no place."""
    boxes = np.zeros((0, 4))
    for _ in range(arena.obstacles):
        for _ in range(_DRAWS):
            sides = rng.uniform(arena.shortest, arena.longest, 2)
            low = rng.uniform(arena.gap, arena.side - arena.gap - sides)
            box = np.concatenate([low, low + sides])
            apart = np.maximum(boxes[:, :2] - box[2:], box[:2] - boxes[:, 2:])
            # Far enough along one axis or the other.
            if (apart.max(axis=1, initial=-np.inf) >= arena.gap).all():
                boxes = np.vstack([boxes, box])
                break
        else:
            return None
    return boxes

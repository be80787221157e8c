"""Fields drawn at random, of twelve families, on which no planner has been tried."""

import runpy
from pathlib import Path

import numpy as np
import shapely

from sightfield.systems.numerics.harvest.field.field import Field

TESTS = Path(__file__).parents[1] / "tests" / "numerics" / "harvest"
_SHAPES = runpy.run_path(str(TESTS / "field_makers.py"))
_disc, _field, _star, _banana, _blob, _bend = (
    _SHAPES[name] for name in ("_disc", "_field", "_star", "_banana", "_blob", "_bend")
)

# Those of the tests, by name.
MADE_FIELDS = _SHAPES["FIELDS"]

FAMILIES = (
    "rectangle",
    "quadrilateral",
    "blob",
    "star",
    "banana",
    "L",
    "pond",
    "poles",
    "strip",
    "bend",
    "triangle",
    "neck",
)

# Combines and carts that are drawn.
CREWS = ((1, 1), (2, 1), (3, 1), (2, 2), (4, 2), (3, 2), (6, 2), (4, 1), (5, 3))


def draw_field(seed: int) -> tuple[str, Field]:
    """A field of 2 to 14 ha and the name of its family, which goes by the seed.

    Args:
        seed: 0 or positive.
    """
    random = np.random.default_rng(seed)
    family = FAMILIES[seed % len(FAMILIES)]
    if family in ("pond", "poles"):
        return family, _with_obstacles(family, random.uniform, random)
    shape = _shape(family, random.uniform, random, seed)
    if family not in ("blob", "bend", "neck"):
        shape = shapely.affinity.rotate(shape, random.uniform(-90, 90), origin=(0, 0))
    return family, _field(shape)


def draw_crew(seed: int) -> tuple[int, int]:
    """Numbers of combines and carts.

    Args:
        seed: 0 or positive.
    """
    return CREWS[int(np.random.default_rng(seed + 10**6).integers(len(CREWS)))]


def _shape(family, u, random, seed) -> shapely.Polygon:
    if family == "rectangle":
        return shapely.box(0, 0, u(120, 450), u(90, 300))
    if family == "quadrilateral":
        corners = [(u(250, 450), u(-40, 40)), (u(200, 350), u(180, 330)), (u(-40, 80), u(150, 300))]
        return shapely.Polygon([(0, 0), *corners])
    if family == "triangle":
        return shapely.Polygon([(0, 0), (u(300, 500), u(0, 60)), (u(50, 300), u(200, 400))])
    if family == "blob":
        return _blob(seed, u(120, 230), u(0.1, 0.25))
    if family == "star":
        return _star(u(200, 300), u(0.45, 0.7), int(random.integers(4, 8)))
    if family == "banana":
        return _banana(u(180, 320), u(60, 120), u(1, 2.6))
    if family == "L":
        wide, high, low, narrow = u(250, 450), u(250, 380), u(80, 180), u(80, 180)
        inner = [(wide, low), (narrow, low), (narrow, high)]
        return shapely.Polygon([(0, 0), (wide, 0), *inner, (0, high)])
    if family == "strip":
        return shapely.box(0, 0, u(400, 1000), u(40, 70))
    if family == "bend":
        way = [(u(150, 300), u(50, 120)), (u(330, 400), u(150, 330)), (u(500, 600), u(250, 400))]
        return _bend([(0, 0), *way], u(70, 120))
    opening = u(14, 40)
    left, right = shapely.box(0, 0, u(120, 200), 200), shapely.box(230, 20, u(330, 420), 220)
    return shapely.union_all([left, right, shapely.box(110, 90, 240, 90 + opening)])


def _with_obstacles(family, u, random) -> Field:
    wide, high = u(250, 450), u(180, 300)
    if family == "pond":
        at, radius = (u(0.25, 0.75) * wide, u(0.25, 0.75) * high), u(8, 30)
        holes = [_disc(*at, radius, int(random.integers(5, 14)))]
    else:
        count = int(random.integers(1, 4))
        holes = [
            _disc(u(0.15, 0.85) * wide, u(0.15, 0.85) * high, u(0.5, 2), 6) for _ in range(count)
        ]
    return _field(shapely.box(0, 0, wide, high), tuple(holes))

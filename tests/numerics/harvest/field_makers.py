"""Fields of many shapes and sizes, for tests of the harvest."""

import math
from collections.abc import Callable

import numpy as np
import shapely

from sightfield.systems.numerics.geometry.world import world_from_polygon
from sightfield.systems.numerics.harvest.field.field import Field


def _field(shape: shapely.Polygon, holes: tuple[shapely.Polygon, ...] = ()) -> Field:
    return Field(world_from_polygon(shape.difference(shapely.union_all(list(holes)))))


def _box(width: float, height: float, turned: float = 0.0) -> shapely.Polygon:
    return _turned(shapely.box(0, 0, width, height), turned)


def _disc(x: float, y: float, radius: float, corners: int = 12) -> shapely.Polygon:
    angles = 2 * math.pi * np.arange(corners) / corners
    return shapely.Polygon(
        np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])
    )


def _star(radius: float, inner: float, points: int) -> shapely.Polygon:
    angles = math.pi * np.arange(2 * points) / points + 0.3
    radii = np.where(np.arange(2 * points) % 2, inner * radius, radius)
    return shapely.Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]))


def _banana(radius: float, width: float, angle: float) -> shapely.Polygon:
    angles = np.linspace(0.0, angle, 40)
    arc = np.column_stack([radius * np.cos(angles), radius * np.sin(angles)])
    return shapely.LineString(arc).buffer(width / 2, cap_style="flat").simplify(0.1)


def _blob(seed: int, radius: float, rough: float) -> shapely.Polygon:
    rng = np.random.default_rng(seed)
    angles = np.linspace(0, 2 * math.pi, 60, endpoint=False)
    radii = np.full(60, 1.0)
    for wave in range(2, 6):
        radii += rough / wave * rng.normal() * np.cos(wave * angles + rng.uniform(0, 6.3))
    points = radius * radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return shapely.Polygon(points)


def _turned(shape: shapely.Polygon, angle: float) -> shapely.Polygon:
    return shapely.affinity.rotate(shape, angle, origin=(0, 0))


def _neck(width: float, opening: float) -> shapely.Polygon:
    left, right = shapely.box(0, 0, 180, 200), shapely.box(230, 20, 420, 220)
    return shapely.union_all([left, right, shapely.box(170, 90, 240, 90 + opening)])


def _bend(points: list[tuple[float, float]], width: float) -> shapely.Polygon:
    return shapely.LineString(points).buffer(width / 2, cap_style="round", quad_segs=4)


FIELDS: dict[str, Callable[[], Field]] = {
    "rectangle_3": lambda: _field(_box(200, 150)),
    "rectangle_10": lambda: _field(_box(400, 250, 20)),
    "rectangle_30": lambda: _field(_box(600, 500, -35)),
    "rectangle_60": lambda: _field(_box(1000, 600, 10)),
    "strip_6": lambda: _field(_box(1000, 60, 15)),
    "strip_3": lambda: _field(_box(700, 45, -10)),
    "trapezium_12": lambda: _field(shapely.Polygon([(0, 0), (450, 0), (330, 300), (60, 300)])),
    "triangle_8": lambda: _field(shapely.Polygon([(0, 0), (480, 40), (180, 380)])),
    "parallelogram_9": lambda: _field(shapely.Polygon([(0, 0), (400, 0), (520, 230), (120, 230)])),
    "hexagon_15": lambda: _field(_disc(0, 0, 240, 6)),
    "circle_12": lambda: _field(_disc(0, 0, 195, 60)),
    "l_9": lambda: _field(
        shapely.Polygon([(0, 0), (400, 0), (400, 150), (180, 150), (180, 350), (0, 350)])
    ),
    "u_14": lambda: _field(
        shapely.Polygon(
            [(0, 0), (450, 0), (450, 380), (320, 380), (320, 140), (140, 140), (140, 380), (0, 380)]
        )
    ),
    "t_10": lambda: _field(
        shapely.Polygon(
            [(150, 0), (300, 0), (300, 200), (450, 200), (450, 340), (0, 340), (0, 200), (150, 200)]
        )
    ),
    "star_9": lambda: _field(_star(260, 0.5, 5)),
    "star_11": lambda: _field(_turned(_star(255.34, 0.5563, 5), 12.84)),
    "star_20": lambda: _field(_star(340, 0.62, 6)),
    "banana_7": lambda: _field(_banana(300, 110, 2.1)),
    "banana_5": lambda: _field(_turned(_banana(317.8306, 65.20954, 2.480104), -10.08483)),
    "banana_4": lambda: _field(_banana(200, 70, 2.6)),
    "blob_5": lambda: _field(_blob(1022, 120.06, 0.2378)),
    "blob_7": lambda: _field(_blob(1070, 144.61, 0.2465)),
    "blob_12": lambda: _field(_blob(3, 200, 0.22)),
    "blob_30": lambda: _field(_blob(8, 310, 0.25)),
    "neck_8": lambda: _field(_neck(420, 14)),
    "neck_9": lambda: _field(_neck(420, 40)),
    "zigzag_8": lambda: _field(_bend([(0, 0), (250, 90), (330, 330), (600, 380)], 110)),
    "pond_10": lambda: _field(_box(400, 250), (_disc(210, 120, 25, 10),)),
    "pond_20": lambda: _field(_box(500, 400, 12), (_disc(200, 250, 45, 16),)),
    "pole_6": lambda: _field(_box(300, 200), (_disc(140, 90, 1.0, 6),)),
    "poles_12": lambda: _field(
        _box(400, 300, 8), tuple(_disc(x, y, 0.8, 6) for x, y in ((60, 90), (170, 170), (270, 240)))
    ),
    "pond_edge_9": lambda: _field(_box(360, 250), (_disc(330, 130, 14, 9),)),
    "river_5": lambda: _field(_box(300, 180), (_bend([(60, 50), (230, 130)], 8),)),
    "river_15": lambda: _field(
        _box(500, 300), (_bend([(90, 60), (220, 140), (300, 150), (420, 230)], 12),)
    ),
    "ponds_25": lambda: _field(
        _box(600, 420, -18),
        (_disc(230, 60, 30, 12), _disc(480, 60, 18, 8), shapely.box(260, 150, 300, 240)),
    ),
    "l_pond_16": lambda: _field(
        shapely.Polygon([(0, 0), (500, 0), (500, 210), (260, 210), (260, 430), (0, 430)]),
        (_disc(120, 150, 22, 9),),
    ),
}

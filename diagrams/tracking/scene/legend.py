"""What the colours mean, at the foot of the panel."""

import numpy as np
import shapely

from ...visuals.meshes import Mesh, arrow_mesh, bar_mesh, flat_mesh, line_mesh
from ...visuals.stage import Stage
from ...visuals.text import text_mesh
from .layout import Layout
from .losing_layer import BANDS
from .palette import (
    CHASE,
    FIELD,
    GROWN_BOUNDARY,
    INK,
    LINE_OF_SIGHT,
    LOSING,
    OBSTACLE,
    POLYGON,
)

# Height of a letter, relative to the view's height.
_LETTER = 0.0145


def draw_legend(
    stage: Stage,
    layout: Layout,
    corner: tuple[float, float, float],
    top: float,
    *,
    losing: bool = False,
) -> None:
    """Draw samples with their names, in two columns.

    Args:
        stage: Where to draw.
        layout: Sizes.
        corner: Left edge, bottom and right edge [m].
        top: Top [m].
        losing: Name the places where an evader is lost, too.
    """
    left, bottom, right = corner
    size = _LETTER * layout.span
    width = 2.2 * size
    patch = shapely.box(0.0, -0.6 * size, width, 0.6 * size)
    outline = line_mesh([shapely.get_coordinates(patch)], 1.3 * layout.line)
    arrow = arrow_mesh(np.array([[0.5 * width, 0.0]]), np.array([[1.0, 0.0]]), width)
    samples = [
        ("line of sight", _stroke(width, layout.line), LINE_OF_SIGHT),
        ("chase", _stroke(width, 2.6 * layout.line), CHASE),
        ("obstacle", flat_mesh(patch), OBSTACLE),
        ("grown boundary", outline, GROWN_BOUNDARY),
        ("visible area", flat_mesh(patch), POLYGON),
        ("pursuit field", arrow, FIELD),
    ]
    if losing:
        samples += [
            (f"lost within {BANDS[0]:g} s", flat_mesh(patch), LOSING[0]),
            ("lost later", flat_mesh(patch), LOSING[-1]),
        ]
    step = (top - bottom) / (len(samples) // 2)
    for k, (words, mesh, colour) in enumerate(samples):
        x = left if k % 2 == 0 else left + 0.48 * (right - left)
        y = top - (k // 2 + 0.5) * step
        stage.mesh(f"legend/{k}/sample", mesh, colour)
        stage.mesh(f"legend/{k}/words", text_mesh(words, size), INK)
        stage.place(f"legend/{k}/words", width + 0.7 * size, -0.5 * size)
        stage.place(f"legend/{k}", x, y)


def _stroke(width: float, thickness: float) -> Mesh:
    return bar_mesh(np.array([[0.0, 0.0]]), np.array([[width, 0.0]]), thickness)

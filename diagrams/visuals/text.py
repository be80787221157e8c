"""Text as flat meshes, since Meshcat has none: outlines of DejaVu Sans filled with triangles."""

from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
import shapely
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from shapely.geometry.base import BaseGeometry

from .meshes import Mesh, flat_mesh

# Outlines are taken at this size and scaled to the height asked for.
_FONT_SIZE = 100.0
# Height of a capital letter of DejaVu Sans, in units of the font size.
_CAPITAL = 0.729


@cache
def _font(bold: bool) -> FontProperties:
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    return FontProperties(fname=str(folder / f"DejaVuSans{'-Bold' if bold else ''}.ttf"))


@cache
def _outline(text: str, bold: bool) -> BaseGeometry:
    """The filled area of a line of text, its baseline from the origin, capitals 1 high."""
    path = TextPath((0.0, 0.0), text, size=_FONT_SIZE, prop=_font(bold))
    shape: BaseGeometry = shapely.MultiPolygon()
    for ring in path.to_polygons(closed_only=True):
        # Even-odd filling: the ring inside a letter takes away what the outer one filled.
        shape = shape.symmetric_difference(shapely.Polygon(np.asarray(ring)).buffer(0))
    shape = shape.simplify(0.15)
    return shapely.transform(shape, lambda points: points / (_FONT_SIZE * _CAPITAL))


@cache
def advance(text: str, *, bold: bool = False) -> float:
    """Width of a line of text with capitals 1 high, the gap after it included.

    Args:
        text: The line.
        bold: Whether it is.

    Returns:
        In units of the height of a capital.
    """
    # Spaces have no outline, so measure between two bars.
    bars = _outline("||", bold).bounds
    return float(_outline(f"|{text}|", bold).bounds[2] - bars[2])


@cache
def text_mesh(text: str, height: float, *, bold: bool = False, align: str = "left") -> Mesh:
    """Draw a line of text about the origin of its path.

    Args:
        text: The line; at least one character must leave a mark.
        height: Of a capital letter [m].
        bold: Draw it heavier.
        align: "left" puts the origin at the start of the baseline, "centre" in the middle of
            the line and of a capital's height.
    """
    shape = _outline(text, bold)
    if align == "centre":
        left, _, right, _ = shape.bounds
        offset = np.array([0.5 * (left + right), 0.5])
    else:
        offset = np.zeros(2)
    return flat_mesh(shapely.transform(shape, lambda points: (points - offset) * height))

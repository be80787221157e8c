"""Text as flat meshes, since Meshcat has none, and numbers of which each place shows one digit.

Outlines of DejaVu Sans are filled with triangles. Matplotlib, which has them, is imported with the
first text: games that nobody looks at need none of it.
"""

from functools import cache
from pathlib import Path

import numpy as np
import shapely
from pydrake.geometry import Rgba
from shapely.geometry.base import BaseGeometry

from .meshes import Mesh, flat_mesh
from .stage import Stage

# Outlines are taken at this size and scaled to the height asked for.
_FONT_SIZE = 100.0
# Height of a capital letter of DejaVu Sans, in units of the font size.
_CAPITAL = 0.729


@cache
def _outline(text: str, bold: bool) -> BaseGeometry:
    """The filled area of a line of text, its baseline from the origin, capitals 1 high."""
    import matplotlib
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    font = FontProperties(fname=str(fonts / f"DejaVuSans{'-Bold' if bold else ''}.ttf"))
    path = TextPath((0.0, 0.0), text, size=_FONT_SIZE, prop=font)
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


class Digits:
    """Shows numbers from 0 up at `PATH/PLACE/DIGIT`; place 0 is the rightmost.

    Numbers that are too large show as all nines.
    """

    def __init__(
        self,
        stage: Stage,
        path: str,
        height: float,
        colour: Rgba,
        *,
        places: int,
        decimals: int = 0,
    ) -> None:
        """Make room for `places` digits, `decimals` of them after a point.

        Args:
            stage: Where to draw.
            path: The first digit's baseline begins at its origin.
            height: Of a digit [m].
            colour: Of the digits.
            places: Number of digits.
            decimals: Number of digits after the point.
        """
        self._stage = stage
        self._path = path
        self._places = places
        self._decimals = decimals
        self._shown: list[int | None] = [None] * places
        self._whole: int | None = None
        step = advance("0", bold=True) * height
        point = advance(".", bold=True) * height if decimals else 0.0
        for place in range(places):
            x = step * (places - 1 - place) + (point if place < decimals else 0.0)
            stage.place(f"{path}/{place}", x, 0.0)
            for digit in range(10):
                stage.mesh(
                    f"{path}/{place}/{digit}", text_mesh(str(digit), height, bold=True), colour
                )
                stage.show(f"{path}/{place}/{digit}", False)
        if decimals:
            stage.mesh(f"{path}/point", text_mesh(".", height, bold=True), colour)
            stage.place(f"{path}/point", step * (places - decimals), 0.0)
        self.width = step * places + point

    def show(self, number: float) -> None:
        """Show a number, cut off after its last decimal, without leading zeros."""
        whole = min(int(number * 10**self._decimals + 1e-6), 10**self._places - 1)
        if whole == self._whole:
            return
        self._whole = whole
        for place in range(self._places):
            digit = whole // 10**place % 10
            leading = whole < 10**place and place > self._decimals
            wanted = None if leading else digit
            before = self._shown[place]
            if wanted != before:
                if before is not None:
                    self._stage.show(f"{self._path}/{place}/{before}", False)
                if wanted is not None:
                    self._stage.show(f"{self._path}/{place}/{wanted}", True)
                self._shown[place] = wanted

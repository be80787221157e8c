"""The colours of the harvest: of combines in plots and in the scene, and of the scene."""

from matplotlib.colors import to_rgb
from pydrake.geometry import Rgba

from ..visuals.lighting import paint

# Thesis, Figure 3.5: red, green, blue; then whatever tells apart. Names of Matplotlib.
COLOURS = ("tab:red", "tab:green", "tab:blue", "tab:orange", "tab:purple", "tab:brown")

MARGIN_GROUND = paint(0.80, 0.86, 0.73)
OBSTACLE = paint(0.55, 0.58, 0.55)
CROP = paint(0.93, 0.75, 0.27)
CROP_ROWS = paint(0.86, 0.66, 0.20)
# How much of its combine's colour standing crop has, by which lands are told apart.
LAND = 0.22
# Of combines with even and with odd numbers, so that rows can be told apart.
STUBBLE = (paint(0.95, 0.91, 0.79), paint(0.91, 0.86, 0.72))
HEADER = paint(0.28, 0.30, 0.34)
AUGER = paint(0.28, 0.30, 0.34)
GRAIN = paint(0.99, 0.80, 0.10)
EMPTY = paint(0.93, 0.94, 0.95)
TRACTOR = paint(0.15, 0.26, 0.22)
TRAILER = paint(0.34, 0.42, 0.40)
TRUCK_BED = paint(0.30, 0.45, 0.62)
TRUCK_CAB = paint(0.16, 0.26, 0.40)


def combine_colour(combine: int) -> str:
    """Name of a combine's colour."""
    return COLOURS[combine % len(COLOURS)]


def combine_paint(combine: int, opacity: float = 1.0) -> Rgba:
    """The paint that shows as a combine's colour in the plots.

    Args:
        combine: Its number.
        opacity: Below 1 the ground is seen through it [-].
    """
    return paint(*to_rgb(combine_colour(combine)), opacity=opacity)


def crop_paint(combine: int) -> Rgba:
    """The paint of standing crop in the land of a combine."""
    crop, own = CROP, combine_paint(combine)

    def mixed(standing: float, owned: float) -> float:
        return (1 - LAND) * standing + LAND * owned

    return Rgba(
        mixed(crop.r(), own.r()), mixed(crop.g(), own.g()), mixed(crop.b(), own.b()), crop.a()
    )

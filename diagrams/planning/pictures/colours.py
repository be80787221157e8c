"""The colours of planners and of times to go, the same in plots and in the replay."""

import matplotlib
import numpy as np
from matplotlib.colors import ListedColormap

# sRGB parts from 0 to 1.
METHOD_COLOURS: dict[str, tuple[float, float, float]] = {
    "casadi": (0.13, 0.37, 0.80),
    "extremal": (0.85, 0.33, 0.10),
    "value-function": (0.10, 0.55, 0.35),
    "polished": (0.88, 0.68, 0.00),
    "primitive": (0.58, 0.22, 0.64),
    "averaging": (0.45, 0.45, 0.45),
}

# How much white is mixed in, so that ways and carts stand out.
_PALENESS = 0.55


def time_colours(count: int) -> ListedColormap:
    """As many colours as bands of time to go, from dark at the goal to pale far away.

    Args:
        count: Number of bands.
    """
    strong = matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, count))[:, :3]
    return ListedColormap(_PALENESS + (1 - _PALENESS) * strong)


def line_width(number: int, count: int) -> float:
    """Thick for the first planner and thin for the last, so that equal paths all show [pt].

    Args:
        number: Of the planner, from 0.
        count: Of planners.
    """
    return 4.0 - 3.2 * number / max(count - 1, 1)

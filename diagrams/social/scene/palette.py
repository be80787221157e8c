"""The colours of the social scene: the tracking scene's, and one for each common agent."""

from pydrake.geometry import Rgba

from ...visuals.lighting import paint

_AGENTS = (
    (0.93, 0.55, 0.10),
    (0.13, 0.60, 0.38),
    (0.56, 0.28, 0.74),
    (0.10, 0.58, 0.66),
    (0.72, 0.50, 0.22),
    (0.82, 0.30, 0.58),
)
LANDMARK = paint(0.20, 0.22, 0.26)
ROUTE = paint(0.13, 0.37, 0.80, 0.85)
ESTIMATE = paint(0.85, 0.18, 0.20)
UNCERTAINTY = paint(0.95, 0.45, 0.45, 0.30)
FRIEND = paint(0.16, 0.60, 0.30)
STRANGER = paint(0.84, 0.86, 0.88)


def agent_rgb(agent: int) -> tuple[float, float, float]:
    """An agent's colour on the screen: red, green, blue from 0 to 1."""
    return _AGENTS[agent % len(_AGENTS)]


def agent_paint(agent: int, opacity: float = 1.0) -> Rgba:
    """The paint that shows as an agent's colour.

    Args:
        agent: Its number.
        opacity: From 0 to 1.
    """
    return paint(*agent_rgb(agent), opacity)

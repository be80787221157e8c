"""The error of a distance estimate, fitted by a parabola.

Source: Zhang 2014, (2.8) and 2.2.7. The thesis has millimetres, here everything is in metres.
"""

from dataclasses import dataclass

from ..errors import require, require_finite

_INCH = 0.0254


@dataclass(frozen=True, kw_only=True)
class ErrorModel:
    """e(y) = a y^2 + b y + c: true distance minus estimated distance, over the true distance y.

    The defaults are the thesis's fit, a = 0.001062 1/mm, b = -0.7598, c = 137 mm, and the
    distances that it was measured at, 15 to 60 inches.

    Raises:
        InvalidInput: A number is not finite, or the distances are in the wrong order.
    """

    # Curvature [1/m]; zero for an error that is a straight line in y.
    a: float = 1.062
    # Slope at y = 0 [1].
    b: float = -0.7598
    # Error at y = 0 [m].
    c: float = 0.137
    # Distances between which the fit was measured [m].
    shortest: float = 15 * _INCH
    longest: float = 60 * _INCH

    def __post_init__(self) -> None:
        for name in ("a", "b", "c", "shortest", "longest"):
            require_finite(name, getattr(self, name))
        require(
            self.shortest < self.longest,
            "shortest",
            f"be less than longest, {self.longest}",
            self.shortest,
        )

    def error(self, y):
        """e(y) [m], for a distance y [m]; scalars or arrays of any kind."""
        return self.a * y * y + self.b * y + self.c

    def covers(self, y: float) -> bool:
        """Whether the fit was measured at this distance [m]; elsewhere it is a guess."""
        return self.shortest <= y <= self.longest


THESIS_ERROR = ErrorModel()

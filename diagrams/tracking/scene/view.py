"""What a viewer chose to look at."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class View:
    """The choices of a viewer of the tracking scene.

    Attributes:
        chosen_pursuer: Whose visibility polygon, losing set and field are drawn; -1 for nobody's.
        polygon_shown: Draw the visibility polygon.
        field_shown: Draw the pursuit field.
        losing_shown: Draw where the pursuer would lose an evader, where that is known.
    """

    chosen_pursuer: int = 0
    polygon_shown: bool = True
    field_shown: bool = True
    losing_shown: bool = True

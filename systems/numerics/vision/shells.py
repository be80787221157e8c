"""The coloured shells that robots wear: upright cylinders that a camera tells apart by colour."""

from dataclasses import dataclass

from ..errors import require, require_non_negative, require_positive

# The shells of Figures 2.26 and 2.27, and others that differ from them in hue.
SHELL_COLOURS: dict[str, tuple[int, int, int]] = {
    "red": (205, 30, 35),
    "green": (30, 165, 60),
    "blue": (35, 70, 200),
    "yellow": (225, 200, 30),
    "magenta": (200, 40, 180),
}


@dataclass(frozen=True, kw_only=True)
class Shell:
    """A coloured upright cylinder around a robot.

    The defaults fit the testbed's robots, whose centres keep 0.16 m from obstacles, and which
    stand on wheels: the shell's bottom edge, to which ranges are measured, is above the floor.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Of the cylinder [m].
    radius: float = 0.1
    # Height of the bottom edge above the floor [m].
    base: float = 0.04
    # Height of the top edge above the floor [m].
    top: float = 0.2
    # Red, green and blue in full white light, each 0 to 255.
    colour: tuple[int, int, int] = SHELL_COLOURS["red"]

    def __post_init__(self) -> None:
        require_positive("radius", self.radius)
        require_non_negative("base", self.base)
        require_positive("top", self.top)
        require(self.top > self.base, "top", f"be above the base, {self.base} m", self.top)
        require(len(self.colour) == 3, "colour", "be (red, green, blue)", self.colour)
        for value in self.colour:
            whole = isinstance(value, int) and not isinstance(value, bool)
            require(whole and 0 <= value <= 255, "colour", "hold whole numbers 0 to 255", value)


def shell_of(colour: str, **sizes: float) -> Shell:
    """A shell in a colour named in SHELL_COLOURS, with sizes [m] other than the defaults.

    Raises:
        InvalidInput: No shell has that colour, or a size is out of its range.
    """
    require(
        colour in SHELL_COLOURS, "colour", f"be one of {', '.join(SHELL_COLOURS)}", repr(colour)
    )
    return Shell(colour=SHELL_COLOURS[colour], **sizes)

"""A team of robots: numbered discs with a nose along the heading."""

from math import atan2

import numpy as np
import shapely
from pydrake.geometry import Rgba

from ...visuals.meshes import Mesh, disc_mesh, extruded_mesh, nose_mesh
from ...visuals.stage import Stage
from ...visuals.text import text_mesh
from .layout import CHOSEN, EVADER, EVADER_NOSE, PAPER, PURSUER, PURSUER_NOSE, Layout

_COLOURS = {"pursuers": (PURSUER, PURSUER_NOSE), "evaders": (EVADER, EVADER_NOSE)}


class Team:
    """Draws the robots of one team at `TEAM/NUMBER`, each node at the robot's position.

    Below the node, `body` turns with the heading; `ghost` covers it, to show a robot that nobody
    sees; `chosen` is a ring around the robot whose view is shown.

    Args:
        stage: Where to draw.
        layout: Sizes.
        name: TEAM.
        count: How many robots.
    """

    def __init__(self, stage: Stage, layout: Layout, name: str, count: int) -> None:
        self._stage = stage
        self._name = name
        self._count = count
        self._reach = layout.robot_radius
        colour, nose_colour = _COLOURS[name]
        radius = layout.robot_radius
        top = layout.robot_height
        body = extruded_mesh(shapely.Point(0, 0).buffer(radius, quad_segs=12), 0.0, top)
        nose = nose_mesh(radius, 1.01 * top)
        ring = disc_mesh(1.62 * radius, hole=1.30 * radius)
        for k in range(count):
            node = f"{name}/{k}"
            stage.mesh(f"{node}/body/disc", body, colour)
            stage.mesh(f"{node}/body/nose", nose, nose_colour)
            stage.raise_to(f"{node}/label", 1.02 * top)
            stage.mesh(f"{node}/label", numeral(k, radius), PAPER)
            stage.raise_to(f"{node}/ghost", 1.04 * top)
            draw_ghost(stage, f"{node}/ghost", k, radius, colour)
            stage.show(f"{node}/ghost", False)
            stage.raise_to(f"{node}/chosen", layout.level("boundaries"))
            stage.mesh(f"{node}/chosen", ring, CHOSEN)
            stage.show(f"{node}/chosen", False)

    def move(self, positions: np.ndarray, directions: np.ndarray) -> None:
        """Move robots to positions, turned along directions, both shape (n, 2).

        A direction of zero leaves the heading that was drawn before.
        """
        for k, ((x, y), (dx, dy)) in enumerate(
            zip(positions.tolist(), directions.tolist(), strict=True)
        ):
            self._stage.place(f"{self._name}/{k}", x, y)
            if dx or dy:
                heading = atan2(dy, dx)
                self._stage.pose(f"{self._name}/{k}/body", 0.0, 0.0, heading, reach=self._reach)

    def mark_unseen(self, unseen: np.ndarray) -> None:
        """Show as ghosts the robots that nobody sees.

        Args:
            unseen: Shape (n,).
        """
        for k, hidden in enumerate(unseen.tolist()):
            self._stage.show(f"{self._name}/{k}/ghost", hidden)

    def mark_chosen(self, chosen: int | None) -> None:
        """Ring one robot, or none."""
        for k in range(self._count):
            self._stage.show(f"{self._name}/{k}/chosen", k == chosen)


def draw_ghost(stage: Stage, path: str, number: int, radius: float, colour: Rgba) -> None:
    """Draw the hollow, pale robot that stands for one out of sight.

    Args:
        stage: Where it is drawn.
        path: Its place on the stage.
        number: That it bears.
        radius: [m].
        colour: Its paint.
    """
    stage.mesh(f"{path}/paper", disc_mesh(0.80 * radius), PAPER)
    stage.raise_to(f"{path}/label", 0.02 * radius)
    stage.mesh(f"{path}/label", numeral(number, radius), colour)


def numeral(number: int, radius: float) -> Mesh:
    """The number of a robot, to fit on a disc of a radius [m]."""
    height = (0.95 if number < 10 else 0.72) * radius
    return text_mesh(str(number), height, bold=True, align="centre")

"""Who is the pursuer's friend, as a graph: lines come and go as friendships do."""

import math

import numpy as np
import shapely

from ...tracking.scene.layout import FAINT_INK, PAPER, PURSUER, Layout
from ...visuals.meshes import bar_mesh, disc_mesh, flat_mesh
from ...visuals.stage import Stage
from ...visuals.text import text_mesh
from .palette import FRIEND, STRANGER, agent_paint

_DASHES = 7


class FriendGraph:
    """The pursuer in the middle, the agents around it.

    Of each agent k one of `friends/k/friend` (a line), `friends/k/waiting` (dashes: it was asked)
    and `friends/k/stranger` (a faint thread) is visible.
    """

    def __init__(
        self, stage: Stage, layout: Layout, box: tuple[float, float, float, float], agents: int
    ) -> None:
        """Draw the graph in a box: left, bottom, right, top [m]."""
        self._stage, self._agents = stage, agents
        left, bottom, right, top = box
        centre = np.array([0.5 * (left + right), 0.5 * (bottom + top)])
        size = min(0.034 * layout.span, 0.16 * (top - bottom))
        half = np.array([0.5 * (right - left), 0.5 * (top - bottom)]) - 1.3 * size
        stage.raise_to("friends", layout.level("ink"))
        line = layout.line
        for k in range(agents):
            angle = 0.5 * math.pi - 2 * math.pi * k / agents
            place = centre + half * np.array([math.cos(angle), math.sin(angle)])
            toward = (place - centre) / np.hypot(*(place - centre))
            ends = np.array([centre + 1.25 * size * toward, place - 1.15 * size * toward])
            cuts = np.linspace(0, 1, 2 * _DASHES)[:, None] * (ends[1] - ends[0]) + ends[0]
            for name, mesh, colour in (
                ("friend", bar_mesh(ends[:1], ends[1:], 3.2 * line), FRIEND),
                ("waiting", bar_mesh(cuts[::2], cuts[1::2], 1.8 * line), FAINT_INK),
                ("stranger", bar_mesh(ends[:1], ends[1:], 0.9 * line), STRANGER),
            ):
                stage.mesh(f"friends/{k}/{name}", mesh, colour)
                stage.show(f"friends/{k}/{name}", name == "stranger")
            stage.raise_to(f"friends/{k}/node", 0.001 * layout.span)
            _node(stage, f"friends/{k}/node/at", place, size, str(k + 1), agent_paint(k))
        stage.raise_to("friends/pursuer", 0.001 * layout.span)
        _node(stage, "friends/pursuer/at", centre, 1.2 * size, "P", PURSUER)

    def update(self, connected: np.ndarray, waiting: np.ndarray) -> None:
        """Show who is a friend and who was asked.

        Args:
            connected: Friends, shape (agents,), bool.
            waiting: Those asked, shape (agents,), bool.
        """
        for k in range(self._agents):
            friend, asked = bool(connected[k]), bool(waiting[k])
            self._stage.show(f"friends/{k}/friend", friend)
            self._stage.show(f"friends/{k}/waiting", asked and not friend)
            self._stage.show(f"friends/{k}/stranger", not asked and not friend)


def _node(stage: Stage, path: str, place: np.ndarray, radius: float, name: str, colour) -> None:
    disc = shapely.Point(0, 0).buffer(1.12 * radius, quad_segs=12)
    stage.mesh(f"{path}/rim", flat_mesh(disc, -0.0002), PAPER)
    stage.mesh(f"{path}/disc", disc_mesh(radius), colour)
    stage.raise_to(f"{path}/label", 0.02 * radius)
    stage.mesh(f"{path}/label", text_mesh(name, 0.9 * radius, bold=True, align="centre"), PAPER)
    stage.place(path, *place.tolist())

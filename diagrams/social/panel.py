"""The panel beside the map: clock, counts, whether the evader is located, the graph of friends.

The graph's lines come and go as friendships do.
"""

import math

import numpy as np
import shapely

from ..tracking.scene.layout import FAINT_INK, IN_SIGHT, INK, LOST, PAPER, PURSUER, Layout
from ..visuals.meshes import Mesh, bar_mesh, disc_mesh, flat_mesh
from ..visuals.stage import Stage
from ..visuals.text import Digits, advance, text_mesh
from .crowd_layer import ESTIMATE, FRIEND, LANDMARK, ROUTE, STRANGER, UNCERTAINTY, agent_paint

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


# Heights of letters and places of rows below the panel's top, relative to the view's height.
_PAD, _LETTER = 0.025, 0.0185
_CLOCK_ROW, _CLOCK_LETTER = 0.066, 0.042
_FIRST_ROW, _ROW_STEP = 0.108, 0.034
_BANNER_HEIGHT, _LEGEND_HEIGHT = 0.042, 0.135
# Name of a row's folder: its words, its unit, decimals.
_ROWS = {
    "requests": ("requests sent", "", 0),
    "pictures": ("pictures read", "", 0),
    "locations": ("times located", "", 0),
    "age": ("age of the location", "s", 1),
    "doubt": ("its deviation now", "cm", 0),
}
_BANNERS = {"located": ("EVADER LOCATED", IN_SIGHT), "unknown": ("EVADER NOT YET FOUND", LOST)}


class Panel:
    """Numbers at `numbers/ROW/PLACE/DIGIT`; of `state/located` and `state/unknown` one shows.

    Args:
        stage: Where to draw.
        layout: Sizes.
        agents: How many.
    """

    def __init__(self, stage: Stage, layout: Layout, agents: int) -> None:
        self._stage = stage
        span = self._span = layout.span
        left, bottom, right, top = layout.panel_bounds
        self._left, self._right, self._top = left + _PAD * span, right - _PAD * span, top
        self._letter = _LETTER * span
        stage.mesh("panel/sheet", flat_mesh(shapely.box(left, bottom, right, top)), PAPER)
        for folder in ("panel", "numbers", "state", "legend"):
            stage.raise_to(folder, layout.level("ink"))
        stage.raise_to("panel/sheet", -layout.level("ink"))
        self._clock = self._number("time", "time", "s", 1, _CLOCK_ROW, _CLOCK_LETTER, 5)
        self._numbers: dict[str, Digits] = {}
        for k, (name, (words, unit, decimals)) in enumerate(_ROWS.items()):
            row = _FIRST_ROW + k * _ROW_STEP
            self._numbers[name] = self._number(name, words, unit, decimals, row, _LETTER, 5)
        banner = top - (_FIRST_ROW + (len(_ROWS) - 0.4) * _ROW_STEP + _BANNER_HEIGHT) * span
        for name in _BANNERS:
            self._banner(name, banner)
        legend = bottom + _LEGEND_HEIGHT * span
        heading = banner - 1.9 * self._letter
        self._write("panel/friends", "friends", self._left, heading)
        box = (self._left, legend + 0.3 * self._letter, self._right, heading - 0.4 * self._letter)
        self._graph = FriendGraph(stage, layout, box, agents)
        _legend(stage, layout, (self._left, bottom + 0.015 * span, self._right, legend))

    def update(
        self,
        time: float,
        counts: dict[str, float],
        located: bool,
        connected: np.ndarray,
        waiting: np.ndarray,
    ) -> None:
        """Show a time [s], numbers by the names of the rows, and who is a friend or was asked.

        Args:
            time: [s].
            counts: Numbers by the names of the rows.
            located: Whether the evader has been.
            connected, waiting: Who is a friend, who was asked; shape (agents,) each.
        """
        self._clock.show(time)
        for name, digits in self._numbers.items():
            known = located or name not in ("age", "doubt")
            self._stage.show(f"numbers/{name}", known)
            if known and math.isfinite(counts[name]):
                digits.show(counts[name])
        self._stage.show("state/located", located)
        self._stage.show("state/unknown", not located)
        self._graph.update(connected, waiting)

    def _number(
        self,
        name: str,
        words: str,
        unit: str,
        decimals: int,
        row: float,
        letter: float,
        places: int,
    ) -> Digits:
        y = self._top - row * self._span
        self._write(f"panel/{name}", words, self._left, y)
        right = self._right
        if unit:
            right -= advance(unit) * self._letter
            self._write(f"panel/{name}_unit", unit, right, y)
            right -= 0.4 * self._letter
        path = f"numbers/{name}/digits"
        digits = Digits(
            self._stage, path, letter * self._span, INK, places=places, decimals=decimals
        )
        self._stage.place(path, right - digits.width, y)
        return digits

    def _banner(self, name: str, bottom: float) -> None:
        words, colour = _BANNERS[name]
        height = _BANNER_HEIGHT * self._span
        box = shapely.box(self._left, bottom, self._right, bottom + height)
        pill = box.buffer(-0.25 * height).buffer(0.25 * height, quad_segs=6)
        self._stage.mesh(f"state/{name}/pill", flat_mesh(pill), colour)
        self._stage.raise_to(f"state/{name}/pill", -0.0003 * self._span)
        label = text_mesh(words, self._letter, bold=True, align="centre")
        self._stage.mesh(f"state/{name}/words", label, PAPER)
        middle = 0.5 * (self._left + self._right)
        self._stage.place(f"state/{name}/words", middle, bottom + 0.5 * height)
        self._stage.show(f"state/{name}", False)

    def _write(self, path: str, words: str, x: float, y: float) -> None:
        self._stage.mesh(path, text_mesh(words, self._letter), FAINT_INK)
        self._stage.place(path, x, y)


def _legend(stage: Stage, layout: Layout, box: tuple[float, float, float, float]) -> None:
    """Six samples with their names, in two columns."""
    left, bottom, right, top = box
    size = 0.0145 * layout.span
    width = 2.2 * size
    patch = flat_mesh(shapely.box(0.0, -0.6 * size, width, 0.6 * size))

    def stroke(thickness: float) -> Mesh:
        return bar_mesh(np.zeros((1, 2)), np.array([[width, 0.0]]), thickness)

    line = layout.line
    samples = [
        ("landmark", stroke(4 * line), LANDMARK),
        ("route", stroke(2.2 * line), ROUTE),
        ("estimate", disc_mesh(0.6 * size, hole=0.45 * size), ESTIMATE),
        ("95 % region", patch, UNCERTAINTY),
        ("agent's view", patch, agent_paint(0, 0.3)),
        ("friend", stroke(3.2 * line), FRIEND),
    ]
    step = (top - bottom) / 3
    for k, (words, mesh, colour) in enumerate(samples):
        x = left if k % 2 == 0 else left + 0.5 * (right - left)
        stage.mesh(f"legend/{k}/sample/mark", mesh, colour)
        stage.place(f"legend/{k}/sample/mark", 0.5 * width if words == "estimate" else 0.0, 0.0)
        stage.mesh(f"legend/{k}/words", text_mesh(words, size), INK)
        stage.place(f"legend/{k}/words", width + 0.7 * size, -0.5 * size)
        stage.place(f"legend/{k}", x, top - (k // 2 + 0.5) * step)

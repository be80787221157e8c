"""The newest picture of each common agent, beside the map."""

import numpy as np
import shapely
from pydrake.geometry import Rgba

from ...tracking.scene.layout import FAINT_INK, PAPER, Layout
from ...visuals.meshes import flat_mesh
from ...visuals.picture_square import picture_square
from ...visuals.stage import Stage
from ...visuals.text import advance, text_mesh
from .palette import agent_paint

# Shares of the view's height: the strip right of the map, a title's letters, gaps.
_STRIP, _LETTER, _GAP = 0.345, 0.0165, 0.016
# Width of the images in a recording, which holds one for each time.
_PIXELS = 320
# Agents in one column.
_COLUMN = 4
# What is said of a picture, by its state.
STATES = {"read": "read", "unread": "new"}


class Gallery:
    """Shows a picture of agent k at `pictures/k/NUMBER`; in a recording each has its own path.

    Of `titles/k/read` and `titles/k/unread` one is visible: whether the pursuer has seen it.
    """

    def __init__(self, stage: Stage, layout: Layout, agents: int, proportion: float) -> None:
        """Draw the frames.

        Args:
            stage: Where to draw.
            layout: Sizes.
            agents: How many.
            proportion: Ratio of a picture's height to its width.
        """
        self._stage = stage
        self._count = [0] * agents
        self._shown: list[str | None] = [None] * agents
        self._frames = frames(layout, agents, proportion)
        letter = min(_LETTER * layout.span, 0.11 * self._frames[0][2])
        for folder, level in (("frames", "ink"), ("titles", "ink"), ("pictures", "sight")):
            stage.raise_to(folder, layout.level(level))
        for k, (left, bottom, width, height) in enumerate(self._frames):
            name = f"agent {k + 1}"
            row = bottom + height + 0.5 * letter
            stage.mesh(f"frames/{k}/name", text_mesh(name, letter, bold=True), agent_paint(k))
            stage.place(f"frames/{k}/name", left, row)
            beside = left + (advance(name, bold=True) + 1.0) * letter
            for state, words in STATES.items():
                stage.mesh(f"titles/{k}/{state}", text_mesh(words, letter), FAINT_INK)
                stage.place(f"titles/{k}/{state}", beside, row)
                stage.show(f"titles/{k}/{state}", False)
            sheet = shapely.box(left, bottom, left + width, bottom + height)
            stage.mesh(f"frames/{k}/sheet", flat_mesh(sheet.buffer(0.003 * layout.span)), PAPER)

    def show(self, agent: int, picture: np.ndarray, state: str) -> None:
        """Put a picture, red, green, blue, shape (h, w, 3), into an agent's frame.

        Args:
            agent: Whose.
            picture: Shape (h, w, 3).
            state: "read" or "unread".
        """
        left, bottom, width, height = self._frames[agent]
        path = f"pictures/{agent}/{self._count[agent]}"
        square = picture_square(picture, width, pixels=_PIXELS)
        full_path = f"{self._stage.root}/{path}/square"
        self._stage.meshcat.SetObject(full_path, square, Rgba(1, 1, 1, 1))
        before = self._shown[agent]
        if before is not None and before != path:
            self._stage.show(before, False)
        if before != path:
            self._stage.place(f"{path}/square", left + 0.5 * width, bottom + 0.5 * height)
            self._stage.show(path, True)
        self._shown[agent] = path
        self._count[agent] += self._stage.recording
        for each in STATES:
            self._stage.show(f"titles/{agent}/{each}", each == state)


def frames(
    layout: Layout, count: int, proportion: float
) -> list[tuple[float, float, float, float]]:
    """Left, bottom, width and height of the pictures, column by column from the top down.

    Args:
        layout: Where the gallery is.
        count: Number of pictures.
        proportion: Height over width, a ratio.
    """
    span = layout.span
    _, south, east, north = layout.map_bounds
    left, gap = east + layout.wall + _GAP * span, _GAP * span
    columns = -(-count // _COLUMN)
    rows = -(-count // columns)
    title = 1.9 * _LETTER * span
    room = (north - south - title) / rows - title - gap
    width = (_STRIP * span - (columns + 1) * gap) / columns
    width = min(width, room / proportion)
    height = width * proportion
    return [
        (
            left + (k // rows) * (width + gap),
            # Below Meshcat's bar of controls, which lies over the top of the page.
            north - 2 * title - height - (k % rows) * (height + title + gap),
            width,
            height,
        )
        for k in range(count)
    ]

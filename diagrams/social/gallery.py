"""The newest picture of each common agent beside the map, with what was recognised in it."""

import cv2
import numpy as np
import shapely
from pydrake.geometry import Rgba

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.social.landmarks.forward_camera import ForwardCamera
from ...systems.numerics.social.localisation.location import Reading
from ...systems.numerics.social.network.interface import Picture
from ...systems.numerics.social.recognition.picture_files import decode_picture
from ...systems.numerics.social.recognition.references import MARKER
from ..tracking.scene.layout import FAINT_INK, PAPER, Layout
from ..visuals.lighting import picture_square
from ..visuals.meshes import flat_mesh
from ..visuals.stage import Stage
from ..visuals.text import advance, text_mesh
from .crowd_layer import agent_paint

_MARKER, _LANDMARK, _SHADE = (230, 40, 40), (40, 190, 70), (20, 22, 28)
# Shown instead of what is no picture.
_BLANK = 90


def picture_pixels(picture: Picture, camera: ForwardCamera) -> np.ndarray:
    """Red, green, blue, shape (height, width, 3); plain gray for what is no picture."""
    try:
        return decode_picture(picture.data, camera.width, camera.height)
    except InvalidInput:
        return np.full((camera.height, camera.width, 3), _BLANK, dtype=np.uint8)


def draw_reading(reading: Reading, camera: ForwardCamera) -> np.ndarray:
    """Outline landmarks green and markers red, with their matches, and say what came of it.

    Returns:
        Red, green, blue, shape (height, width, 3), uint8.
    """
    image = picture_pixels(reading.picture, camera).copy()
    thick = max(camera.width // 160, 1)
    size = camera.width / 700
    named: set[int] = set()
    for each in reading.recognition.detections:
        colour = _MARKER if each.subject == MARKER else _LANDMARK
        outline = np.rint(np.clip(each.corners, -4 * camera.width, 4 * camera.width))
        cv2.polylines(image, [outline.astype(np.int32)], True, colour, thick, cv2.LINE_AA)
        for x, y in np.rint(each.pixels).astype(int).tolist():
            cv2.circle(image, (x, y), thick, colour, -1, cv2.LINE_AA)
        if each.subject in named:
            continue
        named.add(each.subject)
        name = "evader" if each.subject == MARKER else f"landmark {each.subject}"
        x, y = outline.min(axis=0).astype(int).tolist()
        at = (min(max(x, 4), camera.width - 8), max(y - 3 * thick, int(24 * size)))
        _write(image, name, at, size, colour)
    words = reading.location.outcome.words
    _write(image, words, (8, camera.height - 12), 1.3 * size, (255, 255, 255))
    return image


def _write(
    image: np.ndarray, words: str, at: tuple[int, int], size: float, colour: tuple[int, int, int]
) -> None:
    for tint, width in ((_SHADE, 4), (colour, 1)):
        thick = max(round(width * size), 1)
        cv2.putText(image, words, at, cv2.FONT_HERSHEY_SIMPLEX, size, tint, thick, cv2.LINE_AA)


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

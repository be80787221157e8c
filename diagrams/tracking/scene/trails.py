"""Trails: where the robots of a team were during the last seconds, fading with age."""

from math import floor

import numpy as np
from pydrake.geometry import Rgba

from ...visuals.meshes import bar_mesh
from ...visuals.stage import Stage
from .layout import Layout

# How long a trail stays, and how long the pieces are that it is made of [s]. A piece is drawn when
# it is complete; until then its robot's body covers most of it.
TRAIL_DURATION = 10.0
PIECE_DURATION = 0.5
_OPACITY = 0.75
# Corners of a trail are at least this far apart [s].
_SAMPLE_PERIOD = 0.1


class Trails:
    """Draws the trails of one team as pieces, each a mesh for the whole team.

    In a recording every piece has a path of its own; on a live page the paths are used again
    when their piece has faded.
    """

    def __init__(self, stage: Stage, layout: Layout, team: str, colour: Rgba) -> None:
        self._stage = stage
        self._folder = f"trails/{team}"
        self._width = 1.5 * layout.line
        self._colour = Rgba(colour.r(), colour.g(), colour.b(), _OPACITY)
        self._samples: list[np.ndarray] = []
        self._sampled = 0.0
        self._tick: int | None = None
        self._pieces: list[int] = []
        self._slots = round(TRAIL_DURATION / PIECE_DURATION) + 1
        stage.raise_to("trails", layout.level("trails"))

    def update(self, time: float, positions: np.ndarray) -> None:
        """Note where the team is.

        Args:
            time: [s].
            positions: Shape (n, 2) [m].
        """
        tick = floor(time / PIECE_DURATION + 1e-6)
        if tick == self._tick:
            if time - self._sampled >= _SAMPLE_PERIOD - 1e-6:
                self._samples.append(positions)
                self._sampled = time
            return
        if self._tick is not None:
            self._samples.append(positions)
            self._finish_piece(tick)
        self._tick, self._sampled = tick, time
        self._samples = [positions]

    def _finish_piece(self, tick: int) -> None:
        track = np.stack(self._samples)
        start, end = track[:-1].reshape(-1, 2), track[1:].reshape(-1, 2)
        moved = (start != end).any(axis=1)
        if moved.any():
            path = self._path(tick)
            self._stage.mesh(path, bar_mesh(start[moved], end[moved], self._width), self._colour)
            self._stage.show(path, True)
            self._pieces.append(tick)
        for piece in self._pieces:
            age = (tick - piece) * PIECE_DURATION
            self._stage.fade(self._path(piece), _OPACITY * max(0.0, 1.0 - age / TRAIL_DURATION))
            if age >= TRAIL_DURATION:
                self._stage.show(self._path(piece), False)
        self._pieces = [p for p in self._pieces if (tick - p) * PIECE_DURATION < TRAIL_DURATION]

    def _path(self, piece: int) -> str:
        return f"{self._folder}/{piece if self._stage.recording else piece % self._slots}"

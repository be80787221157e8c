"""Shapes that change: a new mesh now and then, recorded as meshes that take turns being shown."""

from math import floor

from pydrake.geometry import Rgba

from .meshes import Mesh
from .stage import Stage


class Keyframes:
    """One changing shape at `FOLDER/0`, or, in a recording, at `FOLDER/0`, `FOLDER/1`, ..."""

    def __init__(self, stage: Stage, folder: str, colour: Rgba, *, period: float) -> None:
        """Draw below a folder of the stage, at most once in a period [s]."""
        self._stage = stage
        self._folder = folder
        self._colour = colour
        self._period = period
        self._tick = -1
        self._count = 0
        self._shown: str | None = None

    def due(self, time: float) -> bool:
        """Whether a period has begun at `time` [s] in which nothing was drawn yet."""
        tick = floor(time / self._period + 1e-6)
        if tick == self._tick:
            return False
        self._tick = tick
        return True

    def draw(self, mesh: Mesh) -> None:
        """Show a shape in place of the one before."""
        path = f"{self._folder}/{self._count}"
        self._stage.mesh(path, mesh, self._colour)
        if self._stage.recording:
            self.clear()
            self._count += 1
        self._stage.show(path, True)
        self._shown = path

    def clear(self) -> None:
        """Show nothing."""
        if self._shown is not None:
            self._stage.show(self._shown, False)
            self._shown = None

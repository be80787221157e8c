"""A Meshcat folder that is told only of changes, and records them so that they play back right."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from .meshes import Mesh


@dataclass
class _Track:
    """The last value of one property of one path, and the frame at which it was recorded."""

    value: Any
    frame: int


class Stage:
    """Draws below one path of Meshcat, sending what changed and recording it.

    Meshcat records transforms and properties, not shapes, and its player interpolates between
    keys, holds the first key backwards in time, and pauses each path at its own last key. So
    here a value that was constant is keyed once more just before it changes; a path that appears
    late is keyed hidden at the start; and `finish_recording` gives every path a key at the end, so
    that all of them last equally long and the player's time slider moves them together.

    Paths are relative to `root`. Lengths are in metres and angles in radians.
    """

    def __init__(self, meshcat: Meshcat, root: str, *, recording: bool, period: float) -> None:
        self.meshcat = meshcat
        self.root = root
        self.recording = recording
        self.period = period
        self._tracks: dict[tuple[str, str], _Track] = {}
        self._frame = 0
        self._previous_frame = 0
        meshcat.Delete(root)
        if recording:
            meshcat.DeleteRecording()
            meshcat.StartRecording(frames_per_second=1.0 / period)

    def begin(self, time: float) -> None:
        """Say that what follows happens at `time` [s]."""
        frame = round(time / self.period)
        if frame != self._frame:
            self._previous_frame, self._frame = self._frame, frame

    def mesh(self, path: str, mesh: Mesh, colour: Rgba) -> None:
        """Put a mesh at a path, in place of what was there. Shapes are not recorded."""
        full_path = f"{self.root}/{path}"
        # Drake's stubs put the dtype of an array where its shape belongs.
        self.meshcat.SetTriangleMesh(full_path, mesh.vertices, mesh.faces, colour)  # pyright: ignore[reportArgumentType]

    def raise_to(self, path: str, height: float) -> None:
        """Lift a folder above the floor, once and for all; what is placed must be below it."""
        self.meshcat.SetTransform(f"{self.root}/{path}", _transform((0.0, 0.0, 0.0), height))

    def place(self, path: str, x: float, y: float) -> None:
        """Move a path, which neither turns nor stretches."""
        self._set(path, "position", (x, y, 0.0))

    def pose(self, path: str, x: float, y: float, angle: float) -> None:
        """Move and turn a path. Meshcat undoes its scale: stretch a child of it instead."""
        self._set(path, "pose", (x, y, angle))

    def stretch(self, path: str, length: float) -> None:
        """Scale a path along its x axis."""
        self._set(path, "scale", (length, 1.0, 1.0))

    def show(self, path: str, visible: bool) -> None:
        """Show or hide a path and all below it."""
        self._set(path, "visible", visible)

    def fade(self, path: str, opacity: float) -> None:
        """Set the opacity of a mesh that was made with an opacity below 1."""
        self._set(f"{path}/<object>", "material.opacity", opacity)

    def finish_recording(self) -> None:
        """Key every recorded value at the present frame and stop recording."""
        for (path, name), track in self._tracks.items():
            if track.frame < self._frame:
                self._key(self._frame, path, name, track.value)
                track.frame = self._frame
        self.meshcat.StopRecording()

    def _set(self, path: str, name: str, value: Any) -> None:
        track = self._tracks.get((path, name))
        if track is not None and track.value == value:
            return
        if self.recording:
            if track is None:
                if name == "visible" and self._frame > 0:
                    self._key(0, path, name, False)
            elif name != "visible" and track.frame < self._previous_frame:
                self._key(self._previous_frame, path, name, track.value)
        self._tracks[path, name] = _Track(value, self._frame)
        # The middle of the frame, so that rounding cannot move it to another one.
        time = (self._frame + 0.5) * self.period if self.recording else None
        full_path = f"{self.root}/{path}"
        if name == "pose":
            self.meshcat.SetTransform(full_path, _transform(value), time)
        elif isinstance(value, tuple):
            self.meshcat.SetProperty(full_path, name, list(value), time)
        else:
            self.meshcat.SetProperty(full_path, name, value, time)

    def _key(self, frame: int, path: str, name: str, value: Any) -> None:
        """Write a key of the recording without touching what is on show."""
        recording = self.meshcat.get_mutable_recording()
        full_path = f"{self.root}/{path}"
        if name == "pose":
            recording.SetTransform(frame, full_path, _transform(value))
        elif isinstance(value, tuple):
            recording.SetProperty(frame, full_path, name, list(value))
        else:
            recording.SetProperty(frame, full_path, name, value)


def _transform(pose: tuple[float, float, float], height: float = 0.0) -> RigidTransform:
    x, y, angle = pose
    place = np.array([x, y, height])
    # Drake's stubs put the dtype of an array where its shape belongs.
    return RigidTransform(RotationMatrix.MakeZRotation(angle), place)  # pyright: ignore[reportArgumentType, reportCallIssue]

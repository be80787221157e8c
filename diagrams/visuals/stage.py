"""A Meshcat folder that is told only of changes, and records them so that they play back right."""

import threading
import weakref
from math import floor, inf

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer, Rgba
from pydrake.math import RigidTransform, RotationMatrix

from ...systems.numerics.errors import require
from .meshes import Mesh

Values = tuple[float, ...]
Sample = tuple[int, Values]

# Pages that a thread has to end, and what keeps those of them alive that nobody holds any longer.
_KEPT: "weakref.WeakSet[Meshcat]" = weakref.WeakSet()
_LEFT: dict[int, list[MeshcatVisualizer]] = {}


def end_on_this_thread(meshcat: Meshcat) -> None:
    """Have a page ended by the thread that made it, whoever lets go of it.

    Drake aborts the process where another thread frees a page, and Python frees what refers to
    itself on whichever thread next looks for it. So a page that nobody holds any longer stays
    until the thread that made it makes, or draws on, another.

    Args:
        meshcat: The page, made by this thread.
    """
    left = _LEFT.setdefault(threading.get_ident(), [])
    left.clear()
    # What stands in for a page may be freed by any thread.
    if isinstance(meshcat, Meshcat) and meshcat not in _KEPT:
        _KEPT.add(meshcat)
        # A visualiser shares the page with Python's own handle on it. Nothing is published.
        weakref.finalize(meshcat, left.append, MeshcatVisualizer(meshcat)).atexit = False


class Glide:
    """Picks keys from samples so that straight lines between keys pass all others closely.

    A key is found out when the next sample no longer lies in line: then it was the one before.
    From the last key, every sample since leaves a cone of slopes that pass it within its
    tolerance; a sample in the cone of all before it needs no key yet.

    Source: the swinging door of Bristol, "Swinging door trending" (1990), with keys on samples.
    """

    __slots__ = ("_high", "_key", "_low", "_previous", "_tolerance", "frame", "values")

    def __init__(self, frame: int, values: Values, tolerance: Values) -> None:
        """Start with a sample.

        Args:
            frame: Its number.
            values: Its components, any unit.
            tolerance: How far each may be missed.
        """
        self.frame = frame
        self.values = values
        self._tolerance = tolerance
        # The last key, and the last sample but one; none before a second frame begins.
        self._key: Sample | None = None
        self._previous: Sample = (frame, values)

    def add(self, frame: int, values: Values, tolerance: Values) -> Sample | None:
        """Add a sample, after the last one or in its place.

        Returns:
            The frame and values of a key that is now known to be needed.
        """
        needed = self._settle() if frame > self.frame else None
        self.frame, self.values, self._tolerance = frame, values, tolerance
        return needed

    def finish(self) -> list[Sample]:
        """The keys that are still missing, that of the last sample among them."""
        needed = self._settle()
        last = (self.frame, self.values)
        return [last] if needed is None else [needed, last]

    def _settle(self) -> Sample | None:
        """Take the last sample for good."""
        last = (self.frame, self.values)
        if self._key is None:
            self._start_from(last)
            return last
        needed = None
        if not self._in_line(self._key):
            needed = self._previous
            self._start_from(needed)
        start_frame, start = needed or self._key
        steps = self.frame - start_frame
        if steps > 0:
            for k, value in enumerate(self.values):
                slope, slack = (value - start[k]) / steps, self._tolerance[k] / steps
                self._low[k] = max(self._low[k], slope - slack)
                self._high[k] = min(self._high[k], slope + slack)
        self._previous = last
        return needed

    def _in_line(self, key: Sample) -> bool:
        """Whether the last sample is in the cone of those between it and the key."""
        steps = self.frame - key[0]
        if self._previous[0] == key[0] or steps == 0:
            return True
        slopes = [(value - start) / steps for value, start in zip(self.values, key[1], strict=True)]
        return all(map(_between, self._low, slopes, self._high))

    def _start_from(self, key: Sample) -> None:
        self._key = self._previous = key
        self._low = [-inf] * len(key[1])
        self._high = [inf] * len(key[1])


def _between(low: float, value: float, high: float) -> bool:
    return low <= value <= high


# Opacities closer than this look the same.
_OPACITY_TOLERANCE = 0.01

# What has changed by less than this part of its tolerance is not told yet.
_UNSEEN = 0.25


class Stage:
    """Draws below one path of Meshcat, sending what changed and recording it.

    Meshcat records transforms and properties, not shapes, and its player interpolates between
    keys, holds the first key backwards in time, and pauses each path at its own last key. So
    here a path that stood still is keyed once more just before it moves; a motion is keyed only
    where it leaves the straight line; a path that appears late is keyed hidden at the start; and
    `finish_recording` gives every path a key at the end, so that all of them last equally long
    and the player's time slider moves them together.

    Paths are relative to `root`. Lengths are in metres and angles in radians.
    """

    def __init__(
        self, meshcat: Meshcat, root: str, *, recording: bool, period: float, tolerance: float
    ) -> None:
        """Clear the folder, and start a new recording if there is to be one.

        Args:
            meshcat: Where to draw.
            root: The folder.
            recording: Record what is drawn.
            period: Between frames [s].
            tolerance: How far a replay may pass from where things were [m].
        """
        end_on_this_thread(meshcat)
        self.meshcat = meshcat
        self.root = root
        self.recording = recording
        self.period = period
        self._tolerance = tolerance
        self._shown: dict[str, bool] = {}
        self._values: dict[tuple[str, str], Values] = {}
        self._glides: dict[tuple[str, str], Glide] = {}
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
        if colour.a() < 1.0:
            # Meshcat draws what is nearer first: glass must not hide the glass below it.
            self.meshcat.SetProperty(f"{full_path}/<object>", "material.depthWrite", False)

    def raise_to(self, path: str, height: float) -> None:
        """Lift a folder above the floor, once and for all; what is placed must be below it.

        Args:
            path: Of the folder.
            height: [m].
        """
        self.meshcat.SetTransform(f"{self.root}/{path}", _transform((0.0, 0.0, 0.0), height))

    def show(self, path: str, visible: bool) -> None:
        """Show or hide a path and all below it.

        Args:
            path: What.
            visible: Show, or hide.
        """
        if self._shown.get(path) == visible:
            return
        full_path = f"{self.root}/{path}"
        self.meshcat.SetProperty(full_path, "visible", visible)
        if self.recording:
            recording = self.meshcat.get_mutable_recording()
            if path not in self._shown and self._frame > 0:
                recording.SetProperty(0, full_path, "visible", False)
            recording.SetProperty(self._frame, full_path, "visible", visible)
        self._shown[path] = visible

    def place(self, path: str, x: float, y: float) -> None:
        """Move a path, which neither turns nor stretches.

        Args:
            path: What.
            x, y: Where to [m].
        """
        near = self._tolerance
        self._glide(path, "position", (x, y, 0.0), near, near, near)

    def pose(self, path: str, x: float, y: float, angle: float, *, reach: float) -> None:
        """Move and turn a path below which things are drawn up to `reach` from its origin.

        Meshcat undoes its scale: stretch a child of it instead.

        Args:
            path: What.
            x, y: Where to [m].
            angle: Its heading [rad].
            reach: Of what is drawn below it [m].
        """
        near = self._tolerance
        self._glide(path, "pose", (x, y, angle), near, near, near / max(reach, near))

    def stretch(self, path: str, length: float) -> None:
        """Scale a path along its x axis.

        Args:
            path: What.
            length: Its scale, in metres for something 1 m long.
        """
        near = self._tolerance
        self._glide(path, "scale", (length, 1.0, 1.0), near, near, near)

    def fade(self, path: str, opacity: float) -> None:
        """Set the opacity of a mesh made with one below 1; a replay fades on between calls.

        Args:
            path: What.
            opacity: From 0 to 1.
        """
        name = "material.opacity"
        self._glide(f"{path}/<object>", name, (opacity,), _OPACITY_TOLERANCE, stands=False)

    def finish_recording(self) -> None:
        """Key every recorded value at the present frame and stop recording.

        Raises:
            InvalidInput: The stage was made without `recording`.
        """
        require(self.recording, "recording", "be on to write a replay", self.recording)
        recording = self.meshcat.get_mutable_recording()
        for (path, name), glide in self._glides.items():
            for frame, values in (*glide.finish(), (self._frame, glide.values)):
                self._key(path, name, frame, values)
        for path, visible in self._shown.items():
            recording.SetProperty(self._frame, f"{self.root}/{path}", "visible", visible)
        self.meshcat.StopRecording()

    def _glide(
        self, path: str, name: str, values: Values, *tolerance: float, stands: bool = True
    ) -> None:
        """Send values if they look new, and record them.

        Args:
            path: What has changed.
            name: A property, or "pose".
            values: Its components.
            tolerance: Of each component.
            stands: Values that were not sent since did not change; else they went on changing.
        """
        before = self._values.get((path, name))
        if before is not None and _look_alike(before, values, tolerance):
            return
        self._values[path, name] = values
        self._send(path, name, values)
        if not self.recording:
            return
        glide = self._glides.get((path, name))
        if glide is None:
            self._glides[path, name] = Glide(self._frame, values, tolerance)
            return
        if stands and glide.frame < self._previous_frame:
            self._add(path, name, glide, self._previous_frame, glide.values, tolerance)
        self._add(path, name, glide, self._frame, values, tolerance)

    def _add(
        self, path: str, name: str, glide: Glide, frame: int, values: Values, tolerance: Values
    ) -> None:
        key = glide.add(frame, values, tolerance)
        if key is not None:
            self._key(path, name, *key)

    def _send(self, path: str, name: str, values: Values) -> None:
        full_path = f"{self.root}/{path}"
        if name == "pose":
            self.meshcat.SetTransform(full_path, _transform(values))
        else:
            self.meshcat.SetProperty(full_path, name, _property(values))

    def _key(self, path: str, name: str, frame: int, values: Values) -> None:
        recording = self.meshcat.get_mutable_recording()
        full_path = f"{self.root}/{path}"
        if name == "pose":
            recording.SetTransform(frame, full_path, _transform(values))
        else:
            recording.SetProperty(frame, full_path, name, _property(values))


def _look_alike(before: Values, values: Values, tolerance: Values) -> bool:
    for old, new, near in zip(before, values, tolerance, strict=True):
        if abs(new - old) > _UNSEEN * near:
            return False
    return True


def _property(values: Values) -> list[float] | float:
    """Values as Meshcat takes a property: a vector, or one number."""
    return values[0] if len(values) == 1 else list(values)


def _transform(pose: Values, height: float = 0.0) -> RigidTransform:
    """The transform of x, y and an angle."""
    x, y, angle = pose
    place = np.array([x, y, height])
    # Drake's stubs put the dtype of an array where its shape belongs.
    return RigidTransform(RotationMatrix.MakeZRotation(angle), place)  # pyright: ignore[reportArgumentType, reportCallIssue]


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

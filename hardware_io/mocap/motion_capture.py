"""Vicon, OptiTrack, Qualisys, by the `motioncapture` package in a separate process."""

import contextlib
import json
import queue
import subprocess
import sys
import threading
from collections.abc import Sequence

from ...systems.numerics.errors import InvalidInput, require_extra, require_one_of
from .pose_receiver import NewestPoses, PoseReading

# The package's names of systems; "mock" is its own stand-in, which sees nothing.
KINDS = ("vicon", "optitrack", "optitrack_closed_source", "qualisys", "nokov", "vrpn", "mock")


class MotionCapture:
    """Bodies that a motion capture system tracks.

    A hidden body is missing from frames, so that its pose goes stale. Stamps are the times at which
    frames arrived; the system's own latency is not known.

    Args:
        kind: One of KINDS.
        hostname: Name of the machine that runs the tracking software.
        bodies: Names of the robots there, in the order of the rows.
        patience: How long to wait for the connection [s].

    Raises:
        InvalidInput: The system does not answer, or `motioncapture` is not installed.
    """

    def __init__(
        self, kind: str, hostname: str, bodies: Sequence[str], *, patience: float = 5.0
    ) -> None:
        require_one_of("mocap.source", kind, KINDS)
        require_extra(f"`mocap.source` {kind}", "hardware", ["motioncapture"])
        self._newest = NewestPoses(bodies)
        module = f"{__package__}.tracker_process"
        self._process = subprocess.Popen(
            [sys.executable, "-u", "-m", module, kind, hostname],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # Ctrl-C is for the controller, which needs poses until its robots stand.
            start_new_session=True,
        )
        self._started: queue.Queue[bool] = queue.Queue()
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()
        try:
            connected = self._started.get(timeout=patience)
        except queue.Empty:
            self.close()
            raise InvalidInput(
                f"`mocap.hostname` must be a {kind} that answers; got {hostname}, silent for "
                f"{patience:g} s"
            ) from None
        if not connected:
            why = " ".join(self._complaint().split()) or "it ended"
            self.close()
            raise InvalidInput(
                f"`mocap.hostname` must be a {kind} that answers; got {hostname} ({why})"
            )

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            with contextlib.suppress(json.JSONDecodeError):
                frame = json.loads(line)
                if frame == "connected":
                    self._started.put(True)
                elif isinstance(frame, dict):
                    for name, pose in frame["bodies"].items():
                        self._newest.see(name, pose, frame["stamp"])
        self._started.put(False)

    def _complaint(self) -> str:
        assert self._process.stderr is not None
        return self._process.stderr.read()

    def read(self) -> PoseReading:
        """See `PoseSource`."""
        return self._newest.read()

    def close(self) -> None:
        """End the process that listens."""
        self._process.kill()
        self._process.wait()
        self._reader.join()
        for pipe in (self._process.stdout, self._process.stderr):
            if pipe is not None:
                pipe.close()

"""A process that listens to a motion capture system and writes one line for each frame.

The `motioncapture` package holds Python's interpreter lock while it waits for a connection or a
frame, without a time-out: in the controller's own process it would block the controller.

Run as `python -m sightfield.hardware_io.mocap.tracker_process KIND HOSTNAME`; each line is JSON,
"connected" after the first frame, then the time by `time.monotonic()`, which is the same for all
processes of a machine, and the poses of the bodies seen.
"""

import json
import math
import sys
import time
from typing import Any


def heading_of(x: float, y: float, z: float, w: float) -> float:
    """Heading of a rotation about the vertical, from its quaternion [rad].

    Args:
        x, y, z, w: The quaternion, pure numbers.
    """
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def frame_line(stamp: float, bodies: dict[str, Any]) -> str:
    """Encode a frame from the package's rigid bodies: position [m] and rotation, z up.

    Args:
        stamp: Time of the frame [s].
        bodies: Rigid bodies by name.
    """
    seen = {
        name: [
            float(body.position[0]),
            float(body.position[1]),
            heading_of(body.rotation.x, body.rotation.y, body.rotation.z, body.rotation.w),
        ]
        for name, body in bodies.items()
    }
    return json.dumps({"stamp": stamp, "bodies": seen})


def main() -> None:
    """Listen until standard output is closed."""
    import motioncapture

    kind, hostname = sys.argv[1:3]
    system = motioncapture.connect(kind, {"hostname": hostname})
    # For some kinds `connect` succeeds without any answer: only a frame proves the connection.
    system.waitForNextFrame()
    sys.stdout.write(json.dumps("connected") + "\n")
    sys.stdout.flush()
    while True:
        system.waitForNextFrame()
        sys.stdout.write(frame_line(time.monotonic(), system.rigidBodies) + "\n")
        sys.stdout.flush()
        if kind == "mock":
            # The package's own stand-in does not limit its frame rate.
            time.sleep(0.01)


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:
        pass
    except Exception as error:
        # `MotionCapture` reads it from standard error, and joins it to one line.
        sys.exit(str(error))

"""A ROS 2 bag in one file: messages by topic, in MCAP, compressed and with checksums.

ROS itself is not needed: the package `rosbags` knows the types of messages, and `mcap` writes them.
All times are counted from the start of the run, which is the year 1970 to ROS.
"""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...systems.numerics.errors import InvalidInput, require_extra
from ...systems.numerics.geometry.world import World
from ..outputs import RunRecord, open_record

# A chunk is compressed and checked as one: what is damaged is lost with the rest of it [s], [B].
_CHUNK, _LARGEST_CHUNK = 1.0, 1 << 23
# What a ROS header can hold [s].
_LATEST = 2e9
# How plain little-endian CDR begins.
CDR = bytes([0, 1, 0, 0])
# Outlines of the world: their width [m], and black.
_WIDTH, _BLACK = 0.01, (0.0, 0.0, 0.0, 1.0)
_WORLD_FRAME = "world"
# What a marker is and does, from visualization_msgs/msg/Marker.
_LINE_STRIP, _ADD = 4, 0


def require_mcap() -> None:
    """MCAP files can be written and read.

    Raises:
        InvalidInput: The packages `mcap` or `rosbags` are not installed.
    """
    require_extra("an MCAP file", "mcap", ("mcap", "rosbags"))


class RosBag(RunRecord):
    """Writes messages of a run into a new MCAP file, in chunks of a second of the run.

    Args:
        path: Of the file; must not exist.

    Raises:
        InvalidInput: The file exists, cannot be written, or the extra is not installed.
    """

    def __init__(self, path: Path) -> None:
        require_mcap()
        # Imported here, because nothing else needs it.
        from mcap.writer import Writer
        from rosbags.typesys import Stores, get_typestore

        self.path = path
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._file = open_record(path)
        self._writer = Writer(self._file, chunk_size=_LARGEST_CHUNK, enable_data_crcs=True)
        self._writer.start("ros2", "sightfield")
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._begun = 0.0

    def close(self) -> None:
        """Write the index, and say that nothing follows."""
        if self._file.closed:
            return
        self.flush()
        try:
            self._writer.finish()
            self._file.close()
        except OSError as error:
            raise self._no_room(error) from None

    def leave(self) -> None:
        """Keep what was written of a run that failed, without an end."""
        if not self._file.closed:
            self.flush()
            self._file.close()

    def flush(self) -> None:
        """End the chunk; from here on a crash of program or machine does not lose it."""
        try:
            self._writer.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise self._no_room(error) from None

    def about(self, text: str) -> None:
        """Write what is to be known beside to /about.

        Args:
            text: In JSON.
        """
        self._write("/about", "std_msgs/msg/String", 0.0, data=text)

    def declare(self, topic: str, kind: str, definition: str = "") -> int:
        """Number of a topic's channel, which is made if there is none: 1 and up, in order.

        Args:
            topic: Its name.
            kind: Type of its messages, as `std_msgs/msg/String`.
            definition: Of the type; empty: one of ROS.
        """
        if topic not in self._channels:
            if kind not in self._schemas:
                text = definition or self._store.generate_msgdef(kind, ros_version=2)[0]
                self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", text.encode())
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        return self._channels[topic]

    def write(self, topic: str, time: float, data: bytes) -> None:
        """Write a message in CDR to a topic that was declared.

        Args:
            topic: Its name.
            time: [s].
            data: The message.
        """
        if time >= self._begun + _CHUNK:
            self.flush()
            self._begun = time
        stamp = nanoseconds(time)
        try:
            self._writer.add_message(self._channels[topic], stamp, data, stamp)
        except OSError as error:
            raise self._no_room(error) from None

    def world(self, world: World) -> None:
        """Write the outlines of a world, once and for all, to /world.

        Args:
            world: Its boundary and obstacles.
        """
        markers = [self._outline(number, ring) for number, ring in enumerate(world.rings)]
        self._write("/world", "visualization_msgs/msg/MarkerArray", 0.0, markers=markers)

    def transforms(self, time: float, poses: Mapping[str, Sequence[float]]) -> None:
        """Write where frames lie in the world to /tf.

        Args:
            time: [s].
            poses: Of each frame by name: x, y [m] and heading [rad].
        """
        make = self._make
        transforms = [
            make(
                "geometry_msgs/msg/TransformStamped",
                header=self._header(time),
                child_frame_id=name,
                transform=make(
                    "geometry_msgs/msg/Transform",
                    translation=make("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=0.0),
                    rotation=self._turned(float(heading)),
                ),
            )
            for name, (x, y, heading) in poses.items()
        ]
        self._write("/tf", "tf2_msgs/msg/TFMessage", time, transforms=transforms)

    def twist(self, topic: str, time: float, frame: str, vx: float, vy: float, turn: float) -> None:
        """Write a velocity as a TwistStamped.

        Args:
            topic: Where.
            time: [s].
            frame: In which it is told.
            vx, vy: [m/s].
            turn: Rate of turn [rad/s].
        """
        make = self._make
        linear = make("geometry_msgs/msg/Vector3", x=float(vx), y=float(vy), z=0.0)
        angular = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=float(turn))
        twist = make("geometry_msgs/msg/Twist", linear=linear, angular=angular)
        header = self._header(time, frame)
        self._write(topic, "geometry_msgs/msg/TwistStamped", time, header=header, twist=twist)

    def numbers(self, topic: str, time: float, values: np.ndarray) -> None:
        """Write an array to the last bit as a Float64MultiArray, whose layout says its shape.

        Args:
            topic: Where.
            time: [s].
            values: Of any shape.
        """
        array = np.asarray(values, dtype=np.float64)
        strides = [math.prod(array.shape[k:]) for k in range(array.ndim)]
        sides = [
            self._make("std_msgs/msg/MultiArrayDimension", label="", size=size, stride=stride)
            for size, stride in zip(array.shape, strides, strict=True)
        ]
        layout = self._make("std_msgs/msg/MultiArrayLayout", dim=sides, data_offset=0)
        self._write(
            topic, "std_msgs/msg/Float64MultiArray", time, layout=layout, data=array.ravel()
        )

    def picture(self, topic: str, time: float, frame: str, png: bytes) -> None:
        """Write a picture as a CompressedImage.

        Args:
            topic: Where.
            time: [s].
            frame: Of the camera.
            png: The picture's file.
        """
        self._write(
            topic,
            "sensor_msgs/msg/CompressedImage",
            time,
            header=self._header(time, frame),
            format="png",
            data=np.frombuffer(png, dtype=np.uint8),
        )

    def _outline(self, number: int, ring: np.ndarray) -> Any:
        make, (red, green, blue, alpha) = self._make, _BLACK
        points = [
            make("geometry_msgs/msg/Point", x=float(x), y=float(y), z=0.0)
            for x, y in (*ring, ring[0])
        ]
        origin = make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
        nothing = np.zeros(0, dtype=np.uint8)
        return make(
            "visualization_msgs/msg/Marker",
            header=self._header(0.0),
            ns=_WORLD_FRAME,
            id=number,
            type=_LINE_STRIP,
            action=_ADD,
            pose=make("geometry_msgs/msg/Pose", position=origin, orientation=self._turned(0.0)),
            scale=make("geometry_msgs/msg/Vector3", x=_WIDTH, y=0.0, z=0.0),
            color=make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=alpha),
            lifetime=make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
            frame_locked=False,
            points=points,
            colors=[],
            texture_resource="",
            texture=make(
                "sensor_msgs/msg/CompressedImage",
                header=self._header(0.0),
                format="",
                data=nothing,
            ),
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=make("visualization_msgs/msg/MeshFile", filename="", data=nothing),
            mesh_use_embedded_materials=False,
        )

    def _turned(self, heading: float) -> Any:
        half = 0.5 * heading
        x, y, z, w = 0.0, 0.0, math.sin(half), math.cos(half)
        return self._make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _header(self, time: float, frame: str = _WORLD_FRAME) -> Any:
        seconds, rest = divmod(nanoseconds(time), 10**9)
        stamp = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        return self._make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _write(self, topic: str, kind: str, time: float, **fields: Any) -> None:
        self.declare(topic, kind)
        self.write(topic, time, bytes(self._store.serialize_cdr(self._make(kind, **fields), kind)))

    def _no_room(self, error: OSError) -> InvalidInput:
        # Nothing more is tried: closing would write once more what found no room.
        self._file.raw.close()
        return InvalidInput(
            f"`log` must be on a disk with room; got {self.path} ({error.strerror})"
        )


def nanoseconds(time: float) -> int:
    """A time as bags have it [ns], from 0 to what a ROS header can hold.

    Args:
        time: [s].
    """
    return round(min(max(0.0, time), _LATEST) * 1e9)

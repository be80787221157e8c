"""A ROS 2 bag: messages by topic, in an MCAP file that is compressed and has checksums.

ROS itself is not needed: the package `rosbags` knows the types of messages and how they are
written. All times are counted from the start of the run, which is the year 1970 to ROS.
"""

import math
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.geometry.world import World

# What the folder of a bag is called beside other results.
BAG = "rosbag"

# Outlines of the world: their width [m], and black.
_WIDTH, _BLACK = 0.01, (0.0, 0.0, 0.0, 1.0)
_WORLD_FRAME = "world"
# What a marker is and does, from visualization_msgs/msg/Marker.
_LINE_STRIP, _ADD = 4, 0


def require_rosbags() -> None:
    """Bags can be written.

    Raises:
        InvalidInput: The package `rosbags` is not installed.
    """
    if find_spec("rosbags") is None:
        raise InvalidInput(
            "a bag must be written with the package rosbags: pip install 'sightfield[rosbag]'; "
            "got none"
        )


class RosBag:
    """Writes messages of a run into a new folder, which holds `metadata.yaml` and the MCAP file.

    Use it with `with`. Messages of one topic are written in the order of their times.

    Args:
        folder: Must not exist.
        about: Kept with the bag: texts by name.

    Raises:
        InvalidInput: The package `rosbags` is not installed.
    """

    def __init__(self, folder: Path, about: Mapping[str, str] | None = None) -> None:
        require_rosbags()
        # Imported here, because nothing else needs it.
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        for name, text in (about or {}).items():
            self._writer.set_custom_data(name, text)
        self._topics: dict[str, Any] = {}

    def __enter__(self) -> "RosBag":
        self._writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

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
        seconds, rest = divmod(_nanoseconds(time), 10**9)
        stamp = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        return self._make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _write(self, topic: str, kind: str, time: float, **fields: Any) -> None:
        connection = self._topics.get(topic)
        if connection is None:
            connection = self._writer.add_connection(topic, kind, typestore=self._store)
            self._topics[topic] = connection
        data = self._store.serialize_cdr(self._make(kind, **fields), kind)
        self._writer.write(connection, _nanoseconds(time), data)


def _nanoseconds(time: float) -> int:
    return round(time * 1e9)

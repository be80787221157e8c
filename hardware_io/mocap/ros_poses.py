"""Poses that come as topics of ROS 2, without ROS."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ...systems.numerics.station.ros_topics import pose_topic
from ..kinds.dds_node import Node, Odometry, PoseStamped, TFMessage, planar
from .pose_receiver import NewestPoses, PoseReading

# How often the receiving thread looks whether it is to end [s].
_LOOK = 0.1
_KINDS: dict[str, type] = {"PoseStamped": PoseStamped, "Odometry": Odometry, "tf": TFMessage}


class RosPoses:
    """Bodies whose poses come as PoseStamped or Odometry, a topic for each, or as tf.

    Stamps are the times at which messages came, as the sender's clock may be another machine's. A
    pose is ignored if it is in another frame, not finite, or not newer by its header than the one
    before: then the sender still runs, but gets no new poses itself. Transforms of tf are not
    chained: only those directly from `frame` to a body count.

    Args:
        bodies: Names of the robots, in the order of the rows; for tf, of their frames.
        message: PoseStamped, Odometry or tf.
        topic: Name of the topic, with {body} in place of the body's name; empty: "{body}/pose",
            "{body}/odom" or "tf".
        frame: Frame in which poses must be given.
        domain: Number of the domain (ROS_DOMAIN_ID), 0 to 232.

    Raises:
        InvalidInput: Bodies' names are missing or not distinct, the message is another, a topic
            lacks {body}, or the domain is out of range.
        LinkError: There is no network for the domain.
    """

    def __init__(
        self,
        bodies: Sequence[str],
        *,
        message: str = "PoseStamped",
        topic: str = "",
        frame: str = "world",
        domain: int = 0,
    ) -> None:
        self._newest = NewestPoses(bodies)
        topic = pose_topic(message, topic, domain)
        kind = _KINDS[message]
        self._frame, self._last = frame, dict[str, tuple[int, int]]()
        node = self._node = Node(domain)
        self._readers: list[tuple[Any, Callable[[Any], Iterator[_Found]]]]
        if message == "tf":
            self._readers = [(node.reader(topic, kind), _of_transforms)]
        else:
            names = {body: topic.replace("{body}", body) for body in bodies}
            self._readers = [
                (node.reader(name, kind), _of_body(body)) for body, name in names.items()
            ]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def read(self) -> PoseReading:
        """See `PoseSource`."""
        return self._newest.read()

    def close(self) -> None:
        """Leave the domain."""
        self._ended.set()
        self._thread.join()
        self._readers.clear()
        self._node.close()

    def _listen(self) -> None:
        while not self._ended.is_set():
            self._node.wait(_LOOK)
            now = time.monotonic()
            for reader, found_in in self._readers:
                for message in self._node.take(reader):
                    for body, header, place, turn in found_in(message):
                        self._take(body, header, planar(place, turn), now)

    def _take(self, body: str, header: Any, pose: Sequence[float], now: float) -> None:
        stamp = (header.stamp.sec, header.stamp.nanosec)
        if header.frame_id.strip("/") != self._frame or stamp <= self._last.get(body, (-1, 0)):
            return
        self._last[body] = stamp
        self._newest.see(body, pose, now)


# A body's name, the header, place and orientation.
_Found = tuple[str, Any, Any, Any]


def _of_body(body: str) -> Callable[[Any], Iterator[_Found]]:
    def found_in(message: Any) -> Iterator[_Found]:
        # An Odometry's pose comes with a covariance.
        pose = message.pose.pose if isinstance(message, Odometry) else message.pose
        yield body, message.header, pose.position, pose.orientation

    return found_in


def _of_transforms(message: Any) -> Iterator[_Found]:
    for each in message.transforms:
        name = each.child_frame_id.strip("/")
        yield name, each.header, each.transform.translation, each.transform.rotation

"""A scene of meshcat-python, drawn from inside its server's process."""

from typing import Any

import umsgpack
from meshcat.commands import Delete, SetObject, SetProperty, SetTransform
from meshcat.path import Path
from meshcat.servers.tree import SceneTree
from meshcat.servers.zmqserver import ZMQWebSocketBridge


class _Nobody:
    """Takes the answers that the server would send to another process."""

    def send(self, data: bytes) -> None:
        """Drop one."""


class SceneStore(ZMQWebSocketBridge):
    """Meshcat's own server, without the socket by which other processes draw.

    It keeps the scene and gives it to every page that connects.
    """

    def __init__(self) -> None:
        # Not the base's: that would open ports of its own.
        self.websocket_pool: set[Any] = set()
        self.tree = SceneTree()
        self.zmq_socket = _Nobody()

    def set_object(self, path: str, geometry: Any, material: Any = None) -> None:
        """Draw something at a path, in place of what was there.

        Args:
            path: Where.
            geometry: Its shape.
            material: Its looks.
        """
        self._send(SetObject(geometry, material, _at(path)))

    def set_transform(self, path: str, matrix: Any) -> None:
        """Move what is at a path; `matrix` has shape (4, 4)."""
        self._send(SetTransform(matrix, _at(path)))

    def set_property(self, path: str, key: str, value: Any) -> None:
        """Set a property of what is at a path.

        Args:
            path: Of what.
            key: Name of the property.
            value: Its value.
        """
        self._send(SetProperty(key, value, _at(path)))

    def delete(self, path: str) -> None:
        """Take away what is at a path, and below it."""
        self._send(Delete(_at(path)))

    def _send(self, command: Any) -> None:
        lowered = command.lower()
        frames = [lowered["type"].encode(), lowered["path"].encode(), umsgpack.packb(lowered)]
        self.handle_zmq(frames)


def _at(path: str) -> Path:
    """An absolute path as meshcat has it."""
    parts = tuple(part for part in path.split("/") if part)
    return Path(parts)

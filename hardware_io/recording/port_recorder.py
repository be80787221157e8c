"""Writes what ports of a diagram say, tick by tick."""

from typing import Any

import cv2
import numpy as np
from pydrake.systems.framework import InputPort, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ...systems.drake_types import AbstractValue, read
from ...systems.numerics.errors import require_non_negative, require_positive
from .mcap_log import McapRunWriter
from .run_writer import RunWriter


class PortRecorder(LeafSystem):
    """Writes a sample of every port at each tick, and a picture whenever it has changed.

    There is an input port for each port of the writer, with `_` for the dots in its name; the
    ports of a recorder of `pursuer.poses` (3 N) and of the picture `omni_camera.image` are shown.

    .. pydrake_system::

        name: PortRecorder
        input_ports:
        - pursuer_poses
        - omni_camera_image
        output_ports: []

    =================  ===========  =========  =======
    port               size         unit       frame
    =================  ===========  =========  =======
    pursuer_poses      3 N          m, m, rad  world
    omni_camera_image  ImageRgba8U  -          picture
    =================  ===========  =========  =======

    Source: ours.

    Args:
        writer: Of the log.
        period: Between ticks [s].
        offset: How long after a tick it looks, when all else has sampled [s].

    Raises:
        InvalidInput: The period is not positive, or the offset negative.
    """

    def __init__(self, writer: RunWriter | McapRunWriter, *, period: float, offset: float = 0.0):
        super().__init__()
        require_positive("period", period)
        require_non_negative("offset", offset)
        self._writer = writer
        self._ports = [
            self.DeclareVectorInputPort(port_name(name), size)
            for name, size in writer.ports.items()
        ]
        blank = AbstractValue.Make(ImageRgba8U())
        self._pictures: list[tuple[str, InputPort]] = [
            (name, self.DeclareAbstractInputPort(port_name(name), blank))
            for name in writer.pictures
        ]
        # Only to write no picture twice: the log is the state.
        self._written: dict[str, np.ndarray] = {}
        self.DeclarePeriodicPublishEvent(period, offset, self._record)

    def _record(self, context):
        time = context.get_time()
        self._writer.samples(time, np.concatenate([read(port, context) for port in self._ports]))
        for name, port in self._pictures:
            image: Any = port.Eval(context)
            last = self._written.get(name)
            if last is None or not np.array_equal(image.data, last):
                self._written[name] = np.array(image.data)
                blue_first = cv2.cvtColor(image.data, cv2.COLOR_RGBA2BGRA)
                _, png = cv2.imencode(".png", blue_first, [cv2.IMWRITE_PNG_COMPRESSION, 1])
                self._writer.picture(time, name, png.tobytes())


def port_name(name: str) -> str:
    """Name of a recorder's input port for a port of the station.

    Args:
        name: Of the station's port.
    """
    return name.replace(".", "_")

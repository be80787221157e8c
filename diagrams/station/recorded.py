"""A recorded run in place of a laboratory."""

from collections.abc import Callable

import cv2
import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from ...systems.numerics.errors import require
from ...systems.station.picture_player import PicturePlayer
from ...systems.station.sample_player import SamplePlayer
from ..tracking.game import TrackingGame
from .hardware import RunLog
from .ports import IMAGE, device_ports
from .scenario import StationScenario


def AddRecordedLaboratory(
    builder: DiagramBuilder, scenario: StationScenario, game: TrackingGame, log: RunLog
) -> dict[str, OutputPort]:
    """Add players of what every device said, tick by tick; return their ports.

    Raises:
        InvalidInput: The log holds no samples, or lacks a port.
    """
    require(len(log.times) > 0, "log", "hold samples", "none")
    sizes = device_ports(scenario)
    ports: dict[str, OutputPort] = {}
    for name, size in sizes.items():
        samples = log.samples.get(name)
        good = samples is not None and samples.shape[1] == size
        require(good, "log", f"have a port {name} of size {size}", sorted(log.samples))
        assert samples is not None
        player = SamplePlayer(samples, _before(name, size, game), period=scenario.period)
        builder.AddNamedSystem(f"player.{name}", player)
        ports[name] = player.GetOutputPort("sample")
    pictures = log.pictures.get(IMAGE, [])
    ticks = [round(time // scenario.period) for time, _ in pictures]
    decode = _decoder([png for _, png in pictures])
    player = PicturePlayer(ticks, decode, period=scenario.period)
    builder.AddNamedSystem(f"player.{IMAGE}", player)
    ports[IMAGE] = player.GetOutputPort("image")
    return ports


def _before(name: str, size: int, game: TrackingGame) -> np.ndarray:
    """What a device says before its first tick, as its receiver begins."""
    if name.endswith(".poses"):
        starts = game.pursuer_starts if name.startswith("pursuer") else game.evader_starts
        return starts.ravel()
    return np.zeros(size)


def _decoder(pictures: list[bytes]) -> Callable[[int], np.ndarray]:
    def decode(number: int) -> np.ndarray:
        coded = np.frombuffer(pictures[number], dtype=np.uint8)
        picture = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED)
        assert picture is not None
        return cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA)

    return decode

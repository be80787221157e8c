"""A recorded run in place of a laboratory."""

from collections.abc import Callable, Mapping

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

    A tick that is lost is as the one before; a picture that is lost is not shown.

    Raises:
        InvalidInput: The log holds no samples, or lacks a port.
    """
    require(len(log.times) > 0, "log", "hold samples", "none")
    sizes = device_ports(scenario)
    period = scenario.period
    ticks = ticks_of(log.times, period)
    # What is lost is as it was before.
    rows = np.searchsorted(ticks, np.arange(ticks[-1] + 1), side="right") - 1
    ports: dict[str, OutputPort] = {}
    for name, size in sizes.items():
        samples = log.samples.get(name)
        good = samples is not None and samples.shape[1] == size
        require(good, "log", f"have a port {name} of size {size}", sorted(log.samples))
        assert samples is not None
        before = _before(name, size, game)
        played = np.where(rows[:, np.newaxis] >= 0, samples[rows], before)
        player = SamplePlayer(played, before, period=period)
        builder.AddNamedSystem(f"player.{name}", player)
        ports[name] = player.GetOutputPort("sample")
    pictures = log.pictures.get(IMAGE, [])
    ticks = [int(tick) for tick in ticks_of(np.array([time for time, _ in pictures]), period)]
    decode = _decoder([png for _, png in pictures])
    player = PicturePlayer(ticks, decode, period=period)
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
        picture = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED) if len(coded) else None
        good = picture is not None and picture.ndim == 3 and picture.shape[2] == 4
        require(good, "log", "have pictures with four channels", f"{len(coded)} bytes of others")
        assert picture is not None
        return cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA)

    return decode


class Gaps:
    """Where ticks of a recording are lost, and what the diagram kept there.

    Args:
        log: The recording.
        period: Between its ticks [s].
    """

    def __init__(self, log: RunLog, period: float) -> None:
        self._ticks = set(ticks_of(log.times, period).tolist())
        self._memory = {round(time / period): known for time, known in log.memory}
        self._gone = False

    def memory_after(self, tick: int) -> Mapping[str, np.ndarray] | None:
        """What to put back after a tick, each asked for in turn; None: the diagram is right."""
        if tick not in self._ticks:
            self._gone = True
            return None
        # The tick after a lost one has seen what was lost, so it is not enough to know that one's.
        known = self._memory.get(tick) if self._gone else None
        self._gone = self._gone and known is None
        return known


def ticks_of(times: np.ndarray, period: float) -> np.ndarray:
    """Numbers of the ticks at which samples were taken, shape (T,).

    Args:
        times: Of the samples, a little after their ticks, shape (T,) [s].
        period: Between ticks [s].
    """
    return np.floor(times / period + 1e-9).astype(int)

"""Harvests made by hand: boxes that drive where a test says."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

HEADER = [[-1.0, -4.5], [1.0, -4.5], [1.0, 4.5], [-1.0, 4.5]]
BODY = [[-8.0, -1.8], [1.0, -1.8], [1.0, 1.8], [-8.0, 1.8]]
TRACTOR = [[-0.6, -1.25], [2.5, -1.25], [2.5, 1.25], [-0.6, 1.25]]
TRAILER = [[-1.4, -1.25], [2.9, -1.25], [2.9, 1.25], [-1.4, 1.25]]
# From the tractor's axle to the hitch, and from there to the trailer's [m].
OFFSET, LENGTH = 0.4, 5.0
DENSITY = 0.7


class HarvestByHand:
    """A combine cuts a field of 200 m by 27 m in three rows, and a cart takes its grain.

    The combine drives along each row at 1.5 m/s, turning outside of the field at both ends on
    half circles of radius 4.5 m; its header is 9 m wide. After the first row its tank is emptied
    into the cart, which stands beyond the field, as if by wire.

    Attributes:
        log: Arrays by name, to be changed at will.
        about: What is in machines.json, likewise.
    """

    def __init__(self) -> None:
        time = np.arange(0.0, 500.25, 0.25)
        speed = np.interp(time, [0, 3, 490, 493, 600], [0, 1.5, 1.5, 0, 0])
        station = np.concatenate([[0.0], np.cumsum((speed[1:] + speed[:-1]) / 2 * 0.25)])
        pose = np.array([_row_pose(s) for s in station])
        inside = (pose[:, 0] > -1.5) & (pose[:, 0] < 201.5) & (np.cos(pose[:, 2]) ** 2 > 0.999)
        area = 9.0 * np.clip(station_in_rows(station), 0.0, None)
        grain = DENSITY * area
        # It unloads between two rows, where it cuts nothing.
        tank = grain - np.where(station > 262, DENSITY * 1800, 0)
        load = grain - tank
        cart = np.array([[250.0, 60.0, 0.3]] * len(time))
        self.log: dict[str, np.ndarray] = {
            "time": time,
            "combine_pose": pose[:, None],
            "combine_speed": speed[:, None],
            "tractor_pose": cart[:, None],
            "trailer_pose": trailer_behind(cart, 0.5)[:, None],
            "tank": tank[:, None],
            "cart_load": load[:, None],
            "cutting": inside[:, None].astype(float),
            "delivered": np.zeros(len(time)),
        }
        self.about: dict = {
            "combines": [{"header": HEADER, "body": BODY, "acceleration": 0.5}],
            "carts": [{"tractor": TRACTOR, "trailer": TRAILER}],
            "parts": [{"boundary": [[0, 0], [200, 0], [200, 27], [0, 27]], "holes": []}],
            "margin": 80.0,
            "density": DENSITY,
        }

    def write(self, folder: Path) -> Path:
        """Write both files; return the folder."""
        np.savez(folder / "log.npz", **self.log)  # type: ignore[arg-type]  # no allow_pickle
        (folder / "machines.json").write_text(json.dumps(self.about), encoding="utf-8")
        return folder


def station_in_rows(station: np.ndarray) -> np.ndarray:
    """Way within the field, of a way from 20 m before it, in rows of 200 m and turns."""
    turn = np.pi * 4.5
    # The header's front, 1 m ahead, cuts.
    front = station + 1.0
    begins = [20 + k * (240 + turn) for k in range(3)]
    return sum(np.clip(front - begin, 0, 200) for begin in begins)


def _row_pose(station: float) -> tuple[float, float, float]:
    """Rows at y = 4.5, 13.5 and 22.5 from x = -20 to 220 and back, and half circles between."""
    turn = np.pi * 4.5
    row, rest = divmod(station, 240 + turn)
    row = int(row)
    right = row % 2 == 0
    y = 4.5 + 9 * row
    if rest <= 240:
        return (-20 + rest if right else 220 - rest), y, 0.0 if right else np.pi
    angle = (rest - 240) / 4.5
    x = 220 if right else -20
    side = 1 if right else -1
    # To the left at the right end, to the right at the left end.
    heading = (0.0 if right else np.pi) + side * angle
    return x + side * 4.5 * np.sin(angle), y + 4.5 - 4.5 * np.cos(angle), heading


def trailer_behind(tractor: np.ndarray, bend: float) -> np.ndarray:
    """Poses of a trailer at a constant angle of its hitch, shape (T, 3) [m], [m], [rad]."""
    x, y, theta = tractor.T
    heading = theta - bend
    return np.column_stack(
        [
            x - OFFSET * np.cos(theta) - LENGTH * np.cos(heading),
            y - OFFSET * np.sin(theta) - LENGTH * np.sin(heading),
            heading,
        ]
    )


@pytest.fixture
def by_hand() -> HarvestByHand:
    """A harvest in which nothing is wrong."""
    return HarvestByHand()


@pytest.fixture
def shapes() -> SimpleNamespace:
    """Outlines as arrays, and a function that puts a trailer behind a tractor."""
    outlines = {
        name: np.array(ring)
        for name, ring in (
            ("header", HEADER),
            ("body", BODY),
            ("tractor", TRACTOR),
            ("trailer", TRAILER),
        )
    }
    behind: Callable = trailer_behind
    return SimpleNamespace(**outlines, behind=behind)

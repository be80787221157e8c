"""Outlines in motion: samples of a pose, and the constant twist between two of them."""

from dataclasses import dataclass

import numpy as np
import shapely

from .harvest_log import HarvestLog, Machine, Site


@dataclass(frozen=True, eq=False)
class MovingOutline:
    """A polygon that moves with a machine.

    The frame of the points is at the middle of their box, and so are the poses: a constant twist
    of a machine is the same twist of every frame that is fixed to it.

    Attributes:
        machine: Whose, as "combine 0".
        points: Corners, counterclockwise, shape (m, 2) [m].
        poses: x, y, theta at the samples, theta continuous, shape (T, 3) [m], [m], [rad].
        reach: Of the farthest corner from the middle [m].
    """

    machine: str
    points: np.ndarray
    poses: np.ndarray
    reach: float


def continuous(poses: np.ndarray) -> np.ndarray:
    """Poses whose headings turn the shorter way round from each to the next, shape (T, 3)."""
    return np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])])


def moving_outline(machine: str, points: np.ndarray, poses: np.ndarray) -> MovingOutline:
    """An outline that moves with a machine, seen from its middle.

    Args:
        machine: Whose it is.
        points: Corners in the frame of the machine's pose, shape (m, 2) [m].
        poses: Of the machine at the samples, shape (T, 3).
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y, theta = continuous(poses).T
    c, s = np.cos(theta), np.sin(theta)
    at = [x + c * middle[0] - s * middle[1], y + s * middle[0] + c * middle[1], theta]
    inner = np.ascontiguousarray(points - middle)
    return MovingOutline(machine, inner, np.column_stack(at), float(np.hypot(*inner.T).max()))


def machines_in_motion(log: HarvestLog, site: Site) -> dict[str, list[MovingOutline]]:
    """The outlines of every machine by its name, combines first."""
    moving: dict[str, list[MovingOutline]] = {}

    def add(name: str, machine: Machine, front: np.ndarray, rear: np.ndarray) -> None:
        moving[name] = [
            moving_outline(name, machine.front, front),
            moving_outline(name, machine.rear, rear),
        ]

    for n, combine in enumerate(site.combines):
        add(f"combine {n}", combine, log.combine_pose[:, n], log.combine_pose[:, n])
    for k, cart in enumerate(site.carts):
        add(f"cart {k}", cart, log.tractor_pose[:, k], log.trailer_pose[:, k])
    return moving


def poses_between(poses: np.ndarray, number: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Poses between samples.

    Args:
        poses: At the samples, with continuous headings, shape (T, 3).
        number: Of the sample before, below T - 1, shape (n,).
        share: Of the time to the next sample that has passed, in [0, 1], shape (n,).

    Returns:
        Shape (n, 3).
    """
    begin, step = poses[number], poses[number + 1] - poses[number]
    half = step[:, 2] / 2
    way = np.hypot(step[:, 0], step[:, 1]) / np.sinc(half / np.pi)
    # The chord of the first part of an arc leans less than the chord of the whole.
    direction = np.arctan2(step[:, 1], step[:, 0]) - half * (1 - share)
    chord = way * share * np.sinc(half * share / np.pi)
    moved = np.column_stack([chord * np.cos(direction), chord * np.sin(direction)])
    return np.column_stack([begin[:, :2] + moved, begin[:, 2] + 2 * half * share])


def polygons_at(outline: MovingOutline, number: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Shapely polygons of an outline between samples, shape (n,).

    Args:
        outline: In motion.
        number: Of the sample before, below T - 1, shape (n,).
        share: Of the time to the next sample that has passed, in [0, 1], shape (n,).
    """
    x, y, theta = poses_between(outline.poses, number, share).T
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    px, py = outline.points.T
    corners = np.stack([x[:, None] + c * px - s * py, y[:, None] + s * px + c * py], axis=-1)
    return np.asarray(shapely.polygons(corners))

"""Speeds at which robots keep a distance from one another."""

import numpy as np


def spaced_commands(
    commands: np.ndarray, poses: np.ndarray, spacing: float, horizon: float
) -> np.ndarray:
    """Slow robots that would come too near to others; their turn rates stay.

    Each may close in on another, forwards or backwards, by half of what is left beyond the
    spacing in a horizon: together two use it up in no less. Who goes away goes as it likes, so
    that robots which are too near come apart. Two on one spot have no direction: they are free.

    Args:
        commands: Speed and turn rate, shape (N, 2) [m/s], [rad/s].
        poses: Shape (N, 3) [m], [m], [rad].
        spacing: Least distance between centres [m].
        horizon: Longer than a command takes to have effect [s].

    Returns:
        Shape (N, 2).
    """
    offsets = poses[None, :, :2] - poses[:, None, :2]
    distances = np.hypot(offsets[..., 0], offsets[..., 1])
    ahead = np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    towards = np.einsum("ijk,ik->ij", offsets, ahead) * commands[:, :1]
    closing = np.divide(towards, distances, out=np.zeros_like(towards), where=distances > 1e-9)
    allowed = np.maximum(distances - spacing, 0.0) / (2.0 * horizon)
    share = np.divide(allowed, closing, out=np.ones_like(closing), where=closing > allowed)
    slowed = commands.copy()
    slowed[:, 0] *= share.min(axis=1)
    return slowed

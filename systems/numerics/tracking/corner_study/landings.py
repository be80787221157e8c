"""Where one step leads a player, from every node of a grid and in every direction."""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from .grid import CornerGrid
from .moves import evader_move, pursuer_move, round_corner


@dataclass(frozen=True, eq=False)
class Landings:
    """Where steps lead, the pursuer's of shape (p, d), the evader's (e, r, d + 1).

    Attributes:
        cell: Index of the interval of the player's angle that it lands in; of that shape.
        share: How far into the interval, 0 to 1; of that shape.
        distance: The pursuer's from the corner [r_p]; the evader's, in nodes of rho; of
            that shape.
    """

    cell: np.ndarray
    share: np.ndarray
    distance: np.ndarray


def pursuer_landings(grid: CornerGrid, angles: np.ndarray, step: float) -> Landings:
    """Where steps at given angles, shape (d,) [rad], lead the pursuer."""
    return Landings(
        *_pursuer_landings(grid.phi_p, np.cos(angles), np.sin(angles), step, grid.alpha)
    )


def evader_landings(grid: CornerGrid, angles: np.ndarray) -> Landings:
    """Where steps at given angles, and last that round the corner, lead the evader.

    Angles have the shape (d,) [rad].

    """
    return Landings(
        *_evader_landings(
            grid.phi_e, grid.rho, np.cos(angles), np.sin(angles), grid.step, grid.alpha
        )
    )


@njit(cache=True)
def _pursuer_landings(phi_p, cosines, sines, step, alpha):
    """Arrays of `Landings` for the pursuer; from the last node, in the star region, none leads."""
    shape = (len(phi_p), len(cosines))
    cell = np.zeros(shape, np.int64)
    share, distance = np.zeros(shape), np.ones(shape)
    spacing = phi_p[1] - phi_p[0]
    for i in range(shape[0] - 1):
        for d in range(shape[1]):
            phi, r, _ = pursuer_move(phi_p[i], cosines[d], sines[d], step, alpha)
            place = (phi - phi_p[0]) / spacing
            cell[i, d] = min(max(int(place), 0), shape[0] - 2)
            share[i, d] = place - cell[i, d]
            distance[i, d] = r
    return cell, share, distance


@njit(cache=True)
def _evader_landings(phi_e, rho, cosines, sines, step, alpha):
    """Arrays of `Landings` for the evader."""
    n = len(cosines)
    shape = (len(phi_e), len(rho), n + 1)
    cell = np.zeros(shape, np.int64)
    share, distance = np.zeros(shape), np.zeros(shape)
    spacing = phi_e[1] - phi_e[0]
    for j in range(shape[0]):
        start = max(phi_e[j], alpha - math.pi)
        for k in range(shape[1]):
            for d in range(n + 1):
                if d < n:
                    phi, r = evader_move(start, rho[k], cosines[d], sines[d], step, alpha)
                else:
                    phi, r = round_corner(start, rho[k], step)
                place = (phi - phi_e[0]) / spacing
                cell[j, k, d] = min(max(int(place), 0), shape[0] - 2)
                share[j, k, d] = place - cell[j, k, d]
                distance[j, k, d] = r / rho[1]
    return cell, share, distance

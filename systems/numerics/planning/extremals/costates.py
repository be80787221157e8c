"""Pontryagin's conditions along a path of arcs.

With H = lambda_x cos(theta) + lambda_y sin(theta) - lambda_beta sin(beta) + omega phi (3.22) and
the switching function phi = lambda_theta + lambda_beta (3.24), lambda_x and lambda_y are constant,
lambda_theta changes by lambda_x dy - lambda_y dx and lambda_beta by the factor g = exp(integral of
cos(beta)). So phi is linear in the costate at the start:

    phi = (y - y0) lambda_x - (x - x0) lambda_y + lambda_theta + g lambda_beta.

The singular arc gives that costate (see `shooting`); without one, phi vanishes at the switches.
"""

import math
from dataclasses import dataclass

import numpy as np

from .arc_path import SHORTEST, Arc, arc_samples
from .arcs import turned_beta

# Of phi, relative to its largest value.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class Extremal:
    """Costate and switching function along a path in the normalised model.

    Attributes:
        times: Both ends of every arc included, shape (n,).
        costates: lambda_x, lambda_y, lambda_theta, lambda_beta, shape (n, 4).
        switching: phi, shape (n,).
        hamiltonian: H, shape (n,).
        holds: Whether phi has the sign of the turn rate on bangs and vanishes on the singular arc,
            and H is constant and not negative; up to rounding.
    """

    times: np.ndarray
    costates: np.ndarray
    switching: np.ndarray
    hamiltonian: np.ndarray
    holds: bool


def extremal_of(start: np.ndarray, arcs: list[Arc], beta_is_free: bool) -> Extremal:
    """Reconstruct the costate of a path and check the conditions.

    Args:
        start: x, y, theta, beta in the normalised model, shape (4,).
        arcs: Bangs and at most one singular arc.
        beta_is_free: Whether the goal leaves beta free, so that lambda_beta vanishes.
    """
    pieces, clocks, growths = [], [], []
    singular = None
    state, clock, growth = np.asarray(start, dtype=float), 0.0, 1.0
    arcs = [arc for arc in arcs if arc.duration >= SHORTEST]
    for arc in arcs:
        times, states, omegas = arc_samples(state, arc)
        if arc.is_singular and abs(arc.omega) > SHORTEST:
            along = omegas / arc.omega
        else:
            along = np.array([turned_beta(state[3], 1.0, arc.omega, float(t))[1] for t in times])
        if arc.is_singular:
            singular = (state, arc.omega, growth)
        pieces.append(np.column_stack([states, omegas]))
        clocks.append(clock + times)
        growths.append(growth * along)
        state, clock, growth = states[-1], clocks[-1][-1], growths[-1][-1]
    x, y, theta, beta, omega = np.concatenate(pieces).T
    rows = np.column_stack([y - y[0], x[0] - x, np.ones(x.shape), np.concatenate(growths)])
    ends = np.cumsum([len(piece) for piece in pieces])[:-1]
    if singular is not None:
        initial = _costate_of_singular_arc(*singular, start)
    else:
        initial = _costate_of_switches(rows[ends], beta_is_free)
        initial = initial if np.sum(omega * (rows @ initial)) >= 0 else -initial
    phi = rows @ initial
    lambda_beta = initial[3] * rows[:, 3]
    hamiltonian = initial[0] * np.cos(theta) + initial[1] * np.sin(theta)
    hamiltonian = hamiltonian - lambda_beta * np.sin(beta) + omega * phi
    scale = max(float(np.max(np.abs(phi))), 1e-3 * float(np.max(np.abs(initial))))
    on_bang = np.concatenate(
        [np.full(len(piece), not arc.is_singular) for piece, arc in zip(pieces, arcs, strict=True)]
    )
    signs_hold = np.all(np.where(on_bang, omega * phi, -np.abs(phi)) >= -_ROUNDING * scale)
    constant = np.ptp(hamiltonian) <= _ROUNDING * max(1.0, float(np.max(np.abs(hamiltonian))))
    costates = np.column_stack([np.tile(initial[:2], (len(x), 1)), phi - lambda_beta, lambda_beta])
    return Extremal(
        times=np.concatenate(clocks),
        costates=costates,
        switching=phi,
        hamiltonian=hamiltonian,
        holds=bool(signs_hold and constant and np.min(hamiltonian) >= -_ROUNDING),
    )


def _costate_of_singular_arc(state, omega, growth, start) -> np.ndarray:
    # Carried back to the start; H = 1.
    x, y, theta, beta = state
    forward, sideways = 1 - omega * math.sin(beta), omega * math.cos(beta)
    east = forward * math.cos(theta) + sideways * math.sin(theta)
    north = forward * math.sin(theta) - sideways * math.cos(theta)
    turn = omega - east * (y - start[1]) + north * (x - start[0])
    return np.array([east, north, turn, -omega / growth])


def _costate_of_switches(rows: np.ndarray, beta_is_free: bool) -> np.ndarray:
    # What the switching function's zeros leave; of several, one.
    if beta_is_free:
        rows = np.vstack([rows, [0.0, 0.0, 0.0, 1.0]])
    if rows.shape[0] == 0:
        return np.array([0.0, 0.0, 1.0, 0.0])
    return np.linalg.svd(rows)[2][-1]

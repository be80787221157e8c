"""The modified field as arrows on the map."""

from collections.abc import Callable

import numpy as np

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.tracking.corner_fields import FIELDS
from ....systems.numerics.tracking.corner_game import corner_table
from ....systems.numerics.tracking.modified_field import modified_velocities
from ....systems.numerics.tracking.risk import RISK_VECTORS
from ....systems.numerics.tracking.team_pursuit import sample_field
from ....systems.tracking.assignment import codes_of
from .picture_game import PictureGame


def modified_field_of(game: PictureGame) -> Callable[..., np.ndarray]:
    """What (2.7) would have a pursuer do anywhere, for the evader that it is assigned to.

    Returns:
        A function of (pursuer, points (m, 2) [m], evaders (Ne, 2) [m], assignment (Np,)) that gives
        velocities in units of the top speed, shape (m, 2).
    """
    scenario, vision = game.scenario, game.scenario.vision
    index, corners = build_edge_index(game.world), corner_table(game.world)
    pursuers, ratio = scenario.pursuers, scenario.speed_ratio
    field = FIELDS[pursuers.field]
    weightings = codes_of("risk_vectors", pursuers.risk_vectors, RISK_VECTORS, pursuers.size)

    def velocities(pursuer, points, evaders, assignment):
        target = assignment[pursuer]
        if target < 0:
            return np.zeros_like(points)
        ex, ey = evaders[target]
        along = sample_field(index, points, ex, ey, corners, field, int(weightings[pursuer]), ratio)
        # Every point is a pursuer after the same evader.
        return modified_velocities(
            vision.weight,
            1.0,
            vision.stand_off,
            vision.fade,
            np.ascontiguousarray(points, dtype=float).ravel(),
            np.asarray(evaders, dtype=float).ravel(),
            np.full(len(points), float(target)),
            along.ravel(),
        ).reshape(-1, 2)

    return velocities

"""Where each pursuer runs: along the fields of the corners it shares, and towards its evader.

The weighted sum of the pursuit fields gives the direction; the speed is the pursuer's top speed,
reduced where a step would overshoot the farthest of the star regions that it makes for. The
modified pursuit adds a pull towards the evader. The thesis's robots may come arbitrarily near their
evaders; here their speed of approach is limited nearby, because robots have bodies.

Source: Zhang 2014, (2.2); 2.2.5, (2.7) and Figure 2.14.
"""

import math

import numpy as np

from ..compiled import compiled
from ..geometry.edge_index import EdgeIndex, point_is_free
from ..geometry.segment_sight import segment_is_clear
from .corner_policies import corner_field
from .risk import remoteness, risk_weights
from .sight_state import split_sight

# If the weighted sum is shorter than this, the threats balance and the pursuer waits.
BALANCE = 1e-9


@compiled
def pursuit_velocity(
    field: int,
    weighting: int,
    px: float,
    py: float,
    ex: float,
    ey: float,
    shared: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    speed: float,
    period: float,
) -> tuple[float, float]:
    """Velocity of one pursuer after one evader (kernel).

    Args:
        field: Code of the pursuit field (`FIELDS`).
        weighting: Code of the risk vector (`RISK_VECTORS`).
        px, py, ex, ey: Positions of pursuer and evader [m].
        shared: 1 for each corner that both see, shape (k,).
        corners: Shape (k, 6), from `corner_table`.
        ratio: Speed ratio a = v_e / v_p.
        speed: Pursuer's top speed [m/s].
        period: For how long the velocity is held [s]; 0 when it changes continuously.

    Returns:
        (vx, vy) [m/s]; zero where no corner threatens.
    """
    count = 0
    directions = np.empty((len(corners), 3))
    remote = np.empty(len(corners))
    for c in range(len(corners)):
        if shared[c] < 0.5:
            continue
        x, y, heading, angle = corners[c, 0], corners[c, 1], corners[c, 2], corners[c, 3]
        ux, uy, reach = corner_field(field, px, py, ex, ey, x, y, heading, angle, ratio)
        if reach == 0.0:
            continue  # seen from the star region: nothing can hide behind this corner
        directions[count, 0], directions[count, 1], directions[count, 2] = ux, uy, reach
        remote[count] = remoteness(weighting, px, py, ex, ey, x, y, heading, angle, ratio)
        count += 1
    weights = risk_weights(weighting, remote[:count])
    vx, vy, reach = 0.0, 0.0, 0.0
    for c in range(count):
        if weights[c] > 0.0:
            vx += weights[c] * directions[c, 0]
            vy += weights[c] * directions[c, 1]
            reach = max(reach, directions[c, 2])
    length = math.hypot(vx, vy)
    if length <= BALANCE:
        return 0.0, 0.0
    pace = min(speed, reach / period) if period > 0.0 else speed
    return pace * vx / length, pace * vy / length


@compiled
def team_pursuit(
    field: int,
    weightings: np.ndarray,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    sight: np.ndarray,
    assignment: np.ndarray,
    corners: np.ndarray,
    ratio: float,
    speed: float,
    period: float,
) -> np.ndarray:
    """Velocities of a team, each member after its own evader.

    Args:
        field: Code of the pursuit field.
        weightings: Code of each pursuer's risk vector, shape (n,).
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        sight: Who sees what, from `observe`.
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        corners, ratio, speed, period: As in `pursuit_velocity`.

    Returns:
        Shape (2 n,) [m/s]; zero for pursuers without an evader.
    """
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(corners)
    _, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    velocities = np.zeros(len(pursuers))
    for i in range(len(assignment)):
        j = int(assignment[i])
        if j < 0:
            continue
        shared = pursuer_corners[i] * evader_corners[j]
        velocities[2 * i], velocities[2 * i + 1] = pursuit_velocity(
            field,
            weightings[i],
            pursuers[2 * i],
            pursuers[2 * i + 1],
            evaders[2 * j],
            evaders[2 * j + 1],
            shared,
            corners,
            ratio,
            speed,
            period,
        )
    return velocities


@compiled
def sample_field(
    index: EdgeIndex,
    points: np.ndarray,
    ex: float,
    ey: float,
    corners: np.ndarray,
    field: int,
    weighting: int,
    ratio: float,
) -> np.ndarray:
    """Direction in which a pursuer at each point would run after one evader, (2.2).

    Args:
        index: Edges of the world.
        points: Shape (n, 2) [m].
        ex, ey: The evader [m].
        corners: Shape (k, 6), from `corner_table`.
        field: Code of the pursuit field (`FIELDS`).
        weighting: Code of the risk vector (`RISK_VECTORS`).
        ratio: Speed ratio a = v_e / v_p.

    Returns:
        Unit vectors, shape (n, 2); zero where no corner threatens, in obstacles, and where the
        evader is out of sight.
    """
    directions = np.zeros((len(points), 2))
    shared = np.zeros(len(corners))
    beside = np.zeros(len(corners))
    for c in range(len(corners)):
        beside[c] = segment_is_clear(index, ex, ey, corners[c, 0], corners[c, 1])
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        if not point_is_free(index, x, y) or not segment_is_clear(index, x, y, ex, ey):
            continue
        for c in range(len(corners)):
            seen = beside[c] > 0.5 and segment_is_clear(index, x, y, corners[c, 0], corners[c, 1])
            shared[c] = 1.0 if seen else 0.0
        # At a speed of 1 m/s.
        directions[n, 0], directions[n, 1] = pursuit_velocity(
            field, weighting, x, y, ex, ey, shared, corners, ratio, 1.0, 0.0
        )
    return directions


# An evader nearer than this has no direction: the pursuer waits [m].
SAME_SPOT = 1e-9


@compiled
def modified_velocities(
    weight: float,
    speed: float,
    stand_off: float,
    fade: float,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    assignment: np.ndarray,
    field: np.ndarray,
) -> np.ndarray:
    """v = w v_o + (1 - w) v' for each pursuer (2.7).

    v' has the length `speed` and points to the pursuer's own evader. The component of v towards
    the evader is then limited to speed * (distance - stand_off) / fade, from -speed to speed, so
    that at the stand-off distance the pursuer comes no nearer, and nearer than that it backs off.

    Args:
        weight: w, from 0 (the pull alone) to 1 (the field alone).
        speed: Top speed [m/s].
        stand_off: Distance from the evader to keep [m].
        fade: Distance beyond the stand-off over which the limit grows to `speed` [m].
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        field: Velocities v_o of the pursuit field, shape (2 n,) [m/s].

    Returns:
        Shape (2 n,) [m/s]; zero for pursuers without an evader.
    """
    velocities = np.zeros(len(pursuers))
    for i in range(len(assignment)):
        j = int(assignment[i])
        if j < 0:
            continue
        x = evaders[2 * j] - pursuers[2 * i]
        y = evaders[2 * j + 1] - pursuers[2 * i + 1]
        distance = math.hypot(x, y)
        if distance < SAME_SPOT:
            continue
        x, y = x / distance, y / distance
        vx = weight * field[2 * i] + (1.0 - weight) * speed * x
        vy = weight * field[2 * i + 1] + (1.0 - weight) * speed * y
        limit = speed * min(max((distance - stand_off) / fade, -1.0), 1.0)
        excess = max(vx * x + vy * y - limit, 0.0)
        vx, vy = vx - excess * x, vy - excess * y
        # Backing off and running along the field at once may be too fast.
        scale = min(speed / max(math.hypot(vx, vy), SAME_SPOT * speed), 1.0)
        velocities[2 * i], velocities[2 * i + 1] = scale * vx, scale * vy
    return velocities

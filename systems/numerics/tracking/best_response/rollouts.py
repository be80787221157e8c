"""Evaders that know the pursuers' rule, and test each of their own plans against it in rollouts.

A plan is a straight run, a run to a corner, or the corner game's best play (`adversarial_evasion`).
For each plan the game is simulated some time ahead: pursuers are assigned and move by their rule,
the other evaders keep their velocities, and all are points without bodies. The plan that breaks
sight first is chosen; if none does, the one that leaves the least margin at the end.

Source: ours; rollouts against a base policy as in Bertsekas, "Rollout, policy iteration, and
distributed reinforcement learning" (2020).
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import EdgeIndex
from ...geometry.segment_sight import CornerIndex, segment_is_clear
from ...geometry.sight_loss import Motion, loss_of_target
from ...geometry.wall_sliding import slide
from ..adversarial_evasion import corner_stance, escape_velocity
from ..assignment.holding import is_broken
from ..assignment.matching import match_small, nearer_first
from ..assignment.team_view import UNASSIGNED
from ..lookahead import least_threat, lookahead_velocities
from ..risk import team_risk
from ..sight_state import split_sight
from ..team_pursuit import team_pursuit
from ..visibility_game.board import Board
from ..visibility_game.bottleneck import COMMITMENT, committed_velocities
from ..visibility_game.pursuit import nodes_of, velocity_minding, who_minds_whom
from ..visibility_game.responsibilities import (
    TeamBoard,
    hardest,
    prospects,
    responsibilities,
    team_velocities,
    watchers,
)
from .common_play import (
    answers_as_before,
    no_common_play,
    remember_answers,
    see_which_corners,
    see_whom,
)

# Plans: by the corner game, along a direction, to a point. A row is kind, x, y.
BY_THE_GAME, ALONG, TO_POINT = 0.0, 1.0, 2.0

# Code of the pursuit by lookahead, which is not a field of corners.
LOOKAHEAD_PURSUIT = -1


# The evaders' model of the assignment: it stays as it is, or it is the Hungarian one with the
# least or the greatest total risk.
FIXED, LEAST_RISK, GREATEST_RISK = 0, 1, 2


class GameRules(NamedTuple):
    """What the evaders know of a game.

    Attributes:
        world: Its edges.
        corner_index: Its corners, as `observe` wants them.
        corners: From `corner_table`, shape (k, 6).
        pursuer_region, evader_region: Edges of the regions in which the centres may be.
        field: Code of the pursuit field, or LOOKAHEAD_PURSUIT.
        weightings: Code of each pursuer's risk vector, shape (n,).
        matching: FIXED, LEAST_RISK or GREATEST_RISK.
        held: Whether pursuers keep an assignment until it is broken (`holding.is_broken`).
        riskiest: Whether unmatched pursuers go after the riskiest evader that they see.
        risk_kinds: Code of each pursuer's risk function, shape (n,).
        ratio: Speed ratio a = v_e / v_p.
        pursuer_speed, evader_speed: Top speeds [m/s].
        standoff: Least distance of an evader's centre from a wall [m].
        commitment: How long certified pursuers commit themselves to a place; 0 for other pursuers
            [s].
    """

    world: EdgeIndex
    corner_index: CornerIndex
    corners: np.ndarray
    pursuer_region: EdgeIndex
    evader_region: EdgeIndex
    field: int
    weightings: np.ndarray
    matching: int
    held: bool
    riskiest: bool
    risk_kinds: np.ndarray
    ratio: float
    pursuer_speed: float
    evader_speed: float
    standoff: float
    commitment: float = 0.0


class Rollout(NamedTuple):
    """How far and how finely plans are simulated.

    Attributes:
        horizon: How far ahead [s].
        step: Time step of the simulation [s].
        headings: Number of straight runs that are tried, evenly spaced over all directions.
        leg: Time after which a straight run continues by the corner game [s].
    """

    horizon: float
    step: float
    headings: int
    leg: float = math.inf


@kernel
def follow_plan(
    kind: float, ax: float, ay: float, x: float, y: float, speed: float, step: float
) -> tuple[float, float]:
    """Velocity along a straight plan (kernel); for BY_THE_GAME see `escape_velocity`.

    Args:
        kind, ax, ay: The plan: ALONG a unit vector, or TO_POINT [m].
        x, y: Where the evader is [m].
        speed: Its top speed [m/s].
        step: Time in which a run to a point must not overshoot it [s].
    """
    if kind == ALONG:
        return speed * ax, speed * ay
    dx, dy = ax - x, ay - y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return 0.0, 0.0
    pace = min(speed, distance / step)
    return pace * dx / distance, pace * dy / distance


@compiled
def choose_plan(
    rules: GameRules,
    rollout: Rollout,
    j: int,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    velocities: np.ndarray,
    assignment: np.ndarray,
    plan: np.ndarray,
    board: Board | None,
    team: TeamBoard | None,
    responsible: np.ndarray | None,
) -> tuple[np.ndarray, float]:
    """Return the best plan of one evader, and its value.

    Args:
        rules: What the evaders know of the game.
        rollout: How plans are simulated.
        j: The evader.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        velocities: Of the evaders; all but evader j keep theirs, shape (2 m,) [m/s].
        assignment: Each pursuer's evader, -1 for none, shape (n,), int.
        plan: The present plan of evader j, shape (3,).
        board: The solved visibility game if pursuers play by it (by the lower bound, as certified
            pursuers do, or by the middle one); where it has no answer they follow the field. None
            if they always follow the field.
        team, responsible: For pursuers that share the evaders out: the solved games of one evader
            and of two, and the pursuer responsible for each evader, shape (m,), int. Then
            `assignment` is not used.

    Returns:
        The plan, shape (3,), and the time until nobody sees the evader, as in `play_plan` [s].
    """
    x, y = evaders[2 * j], evaders[2 * j + 1]
    forward = _away_from_viewer(rules, j, pursuers, evaders)
    if forward == np.inf:
        return np.array([BY_THE_GAME, 0.0, 0.0]), 0.0
    game = rules, rollout, j, pursuers, evaders, velocities, assignment
    common = _common_play(rules, rollout, pursuers, evaders)
    best, least = plan.copy(), _play(*game, plan, np.inf, common, board, team, responsible)
    trial = np.zeros(3)
    corners = rules.corners
    for number in range(-1, rollout.headings + len(corners)):
        if number < 0:
            trial[0], trial[1], trial[2] = BY_THE_GAME, 0.0, 0.0
        elif number < rollout.headings:
            # 0, +1, -1, +2, ...: where a wall makes several runs the same, they tie, and the one
            # nearest to straight away from the viewer is taken, on either side.
            turns = (number + 1) // 2 if number % 2 == 1 else -(number // 2)
            angle = forward + 2.0 * math.pi * turns / rollout.headings
            trial[0], trial[1], trial[2] = ALONG, math.cos(angle), math.sin(angle)
        else:
            c = number - rollout.headings
            cx, cy = corners[c, 0], corners[c, 1]
            reach = rollout.horizon * rules.evader_speed
            if (cx - x) ** 2 + (cy - y) ** 2 > reach * reach:
                continue
            if not segment_is_clear(rules.world, x, y, cx, cy):
                continue
            ox, oy = corner_stance(cx, cy, corners[c, 2], corners[c, 3], rules.standoff)
            trial[0], trial[1], trial[2] = TO_POINT, cx + ox, cy + oy
        value = _play(*game, trial, least, common, board, team, responsible)
        if value < least - 1e-9:
            least = value
            best[:] = trial
    return best, least


@compiled
def play_plan(
    rules: GameRules,
    rollout: Rollout,
    j: int,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    velocities: np.ndarray,
    assignment: np.ndarray,
    plan: np.ndarray,
    least: float,
    board: Board | None,
    team: TeamBoard | None,
    responsible: np.ndarray | None,
) -> float:
    """Return the value of a plan: the time until nobody sees the evader; less is better [s].

    Args:
        rules, rollout, j, pursuers, evaders, velocities, assignment, plan: See `choose_plan`.
        least: Value of the best other plan: the simulation stops beyond it [s].
        board, team, responsible: See `choose_plan`.

    Returns:
        The time of loss. If there is no loss within the horizon, a value above the horizon that
        grows with the margin left at the end.
    """
    game = rules, rollout, j, pursuers, evaders, velocities, assignment
    common = _common_play(rules, rollout, pursuers, evaders)
    return _play(*game, plan, least, common, board, team, responsible)


@kernel
def _turns(rollout: Rollout) -> int:
    return math.ceil(rollout.horizon / rollout.step - 1e-9)


@compiled
def _common_play(rules, rollout, pursuers, evaders):
    """Allocate the results shared by the rollouts of one evader's plans."""
    turns = _turns(rollout) + 1
    return no_common_play(turns, len(pursuers) // 2, len(evaders) // 2, len(rules.corners))


@compiled
def _play(
    rules,
    rollout,
    j,
    pursuers,
    evaders,
    velocities,
    assignment,
    plan,
    least,
    common,
    board,
    team,
    responsible,
):
    """`play_plan`, with the results shared by the rollouts of several plans."""
    n, m, k = len(pursuers) // 2, len(evaders) // 2, len(rules.corners)
    at, others = pursuers.copy(), evaders.copy()
    sight = np.zeros(n * m + (n + m) * k)
    visibility, pursuer_corners, evader_corners = split_sight(sight, n, m, k)
    own = np.empty(rules.corner_index.lines.shape[1])
    index, step = rules.world, rollout.step
    assigned, owners, commitments = assignment, responsible, np.zeros((n, COMMITMENT))
    at_before, others_before = at, others
    steps, committed = _turns(rollout), math.ceil(rules.commitment / step - 1e-9)
    for turn in range(steps + 1):
        if not see_whom(common, turn, j, index, at, others, visibility):
            if turn == 0:
                return 0.0
            # The exact moment of loss: counted in steps, plans would tie.
            motion = Motion(at_before, at, others_before, others)
            return (turn - 1 + min(loss_of_target(index, motion, None, 2 * j), 1.0)) * step
        if turn * step > least:
            return np.inf
        see_which_corners(common, turn, j, index, rules.corner_index, at, others, own, sight)
        if turn == steps:
            break
        seen_by = visibility > 0.5
        # Compiled separately for each case: with None the branch is left out.
        if team is not None:
            one, two = prospects(team, at, others, seen_by)
            owners = responsibilities(one, two, seen_by, owners, team.steps[1])
            watching = watchers(one, two, seen_by, owners)
            assigned = hardest(one, watching)
        elif rules.matching != FIXED and turn > 0:
            assigned = _assign(rules, assigned, at, others, sight)
        if board is not None and committed == 0:
            wished = _guarantee_velocities(
                rules, common, turn, j, board, at, others, sight, assigned, step
            )
        else:
            wished = _field_velocities(rules, at, others, sight, assigned, step)
        if team is not None:
            wished = team_velocities(
                team,
                at,
                others,
                owners,
                watching,  # pyright: ignore[reportPossiblyUnboundVariable]  # comes with a team
                wished,
                rules.pursuer_speed,
                step,
            )
        if board is not None and committed > 0:
            wished = committed_velocities(
                board, at, others, seen_by, assigned, wished, commitments, committed, step
            )
        if plan[0] == BY_THE_GAME or turn * step >= rollout.leg:
            vx, vy = escape_velocity(
                j,
                at,
                others,
                visibility,
                pursuer_corners,
                evader_corners,
                rules.corners,
                rules.ratio,
                rules.evader_speed,
                rules.standoff,
            )
        else:
            vx, vy = follow_plan(
                plan[0],
                plan[1],
                plan[2],
                others[2 * j],
                others[2 * j + 1],
                rules.evader_speed,
                step,
            )
        at_before, others_before = at.copy(), others.copy()
        for i in range(n):
            x, y = at[2 * i], at[2 * i + 1]
            dx, dy = step * wished[2 * i], step * wished[2 * i + 1]
            dx, dy = slide(rules.pursuer_region, x, y, dx, dy)
            at[2 * i], at[2 * i + 1] = x + dx, y + dy
        known = turn + 1 < common.turns[0]
        for e in range(m):
            if known and e != j:
                others[2 * e : 2 * e + 2] = common.evaders[turn + 1, 2 * e : 2 * e + 2]
                continue
            x, y = others[2 * e], others[2 * e + 1]
            ux, uy = (vx, vy) if e == j else (velocities[2 * e], velocities[2 * e + 1])
            dx, dy = slide(rules.evader_region, x, y, step * ux, step * uy)
            others[2 * e], others[2 * e + 1] = x + dx, y + dy
    margin = least_threat(
        j,
        at,
        others,
        visibility,
        pursuer_corners,
        evader_corners,
        rules.corners,
        rules.ratio,
    )
    # A negative margin means an escape that would succeed after the horizon.
    return rollout.horizon + math.exp(min(margin / (rules.evader_speed * rollout.horizon), 50.0))


@compiled
def _field_velocities(rules, pursuers, evaders, sight, assigned, step):
    """Velocities of a team by its pursuit field, shape (2 n,) [m/s]."""
    if rules.field == LOOKAHEAD_PURSUIT:
        return lookahead_velocities(
            rules.pursuer_region,
            pursuers,
            evaders,
            sight,
            assigned,
            rules.corners,
            rules.ratio,
            rules.pursuer_speed,
        )
    return team_pursuit(
        rules.field,
        rules.weightings,
        pursuers,
        evaders,
        sight,
        assigned,
        rules.corners,
        rules.ratio,
        rules.pursuer_speed,
        step,
    )


@compiled
def _guarantee_velocities(rules, common, turn, j, board, pursuers, evaders, sight, assigned, step):
    """`guarantee_velocities`, reusing the velocities that no plan of evader j changes."""
    n, m = len(assigned), len(evaders) // 2
    nodes = nodes_of(board, evaders)
    minded = who_minds_whom(board, pursuers, nodes, sight[: n * m].reshape((n, m)) > 0.5, assigned)
    same, asked = np.zeros(n, dtype=np.bool_), assigned.copy()
    for i in range(n):
        if answers_as_before(common, turn, pursuers, assigned, minded, i, j):
            same[i], asked[i] = True, UNASSIGNED
    velocities = _field_velocities(rules, pursuers, evaders, sight, asked, step)
    for i in range(n):
        x, y = 2 * i, 2 * i + 1
        if same[i]:
            velocities[x], velocities[y] = common.velocities[turn, x], common.velocities[turn, y]
        else:
            velocities[x], velocities[y] = velocity_minding(
                board,
                pursuers[x],
                pursuers[y],
                evaders,
                nodes,
                minded[i],
                int(assigned[i]),
                velocities[x],
                velocities[y],
                rules.pursuer_speed,
                step,
            )
    remember_answers(common, turn, assigned, minded, velocities)
    return velocities


@compiled
def _assign(
    rules: GameRules,
    assigned: np.ndarray,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    sight: np.ndarray,
) -> np.ndarray:
    """Each pursuer's evader by the rule that the evaders know, shape (n,)."""
    n, m = len(rules.weightings), len(evaders) // 2
    visible = sight[: n * m].reshape((n, m)) > 0.5
    if rules.held and not is_broken(visible, assigned):
        return assigned
    risk = team_risk(rules.risk_kinds, evaders, sight, rules.corners)
    greatest = rules.matching == GREATEST_RISK
    targets = match_small(nearer_first(risk, pursuers, evaders, greatest), visible, greatest)
    if rules.riskiest:
        for i in range(n):
            if targets[i] == UNASSIGNED:
                most = -np.inf
                for j in range(m):
                    if visible[i, j] and risk[i, j] > most:
                        targets[i], most = j, risk[i, j]
    return targets


@kernel
def _away_from_viewer(rules: GameRules, j: int, pursuers: np.ndarray, evaders: np.ndarray) -> float:
    """Heading away from the nearest pursuer that sees evader j [rad]; infinite if none does.

    Straight runs are measured from it, so that they are rotated and mirrored with the game.
    """
    nearest, forward = np.inf, np.inf
    x, y = evaders[2 * j], evaders[2 * j + 1]
    for i in range(len(pursuers) // 2):
        dx, dy = x - pursuers[2 * i], y - pursuers[2 * i + 1]
        distance = dx * dx + dy * dy
        if distance < nearest and segment_is_clear(
            rules.world, pursuers[2 * i], pursuers[2 * i + 1], x, y
        ):
            nearest, forward = distance, math.atan2(dy, dx)
    return forward

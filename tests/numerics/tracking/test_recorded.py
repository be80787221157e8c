"""What robots of a game of tracking see and decide is as it was recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.adversarial_evasion import (
    adversarial_velocities,
    escape_outlooks,
)
from sightfield.systems.numerics.tracking.assignment.holding import HOLDS, hold_or_choose
from sightfield.systems.numerics.tracking.assignment.matching import (
    match_small,
    nearer_first,
)
from sightfield.systems.numerics.tracking.assignment.rules import ASSIGNMENT_RULES, decentralised
from sightfield.systems.numerics.tracking.assignment.team_view import TeamView
from sightfield.systems.numerics.tracking.assignment.voting import AGGREGATIONS
from sightfield.systems.numerics.tracking.collision_avoidance import avoid
from sightfield.systems.numerics.tracking.collision_stop import (
    clear_parts,
    count_contacts,
    gap_to_paths,
    gap_to_runners,
    gaps_between_samples,
    pair_gaps,
    still_waiting,
    stop_at_robots,
    stop_at_walls,
    take_turns,
)
from sightfield.systems.numerics.tracking.corner_game import (
    corner_table,
    dash,
    escape_time,
    free_angle,
    from_corner_frame,
    least_escape_time,
    margins,
    region,
    to_corner_frame,
)
from sightfield.systems.numerics.tracking.corner_policies import (
    FIELDS,
    corner_field,
    evader_policy,
    field_grid,
    inside_obstacle,
    margin_field,
    partition,
    pursuer_partition,
    pursuer_policy,
    table_evader_policy,
    table_field,
    table_field_up,
)
from sightfield.systems.numerics.tracking.lookahead import lookahead_velocities
from sightfield.systems.numerics.tracking.mobile_agents import (
    drive_step,
    heading_commands,
    point_step,
    turn_first_command,
)
from sightfield.systems.numerics.tracking.random_starts import draw_starts
from sightfield.systems.numerics.tracking.risk import RISK_VECTORS, team_risk
from sightfield.systems.numerics.tracking.sight_state import observe
from sightfield.systems.numerics.tracking.team_pursuit import (
    modified_velocities,
    sample_field,
    team_pursuit,
)

# No wall lies along an axis, and no two corners are alike.
WORLD = make_world(
    [(0.2, -0.3), (3.6, 0.4), (3.1, 1.9), (2.0, 1.6), (1.6, 2.9), (0.4, 2.4), (-0.3, 1.2)],
    [[(0.7, 0.6), (1.4, 0.7), (1.1, 1.5)], [(2.3, 0.6), (2.6, 0.5), (2.8, 1.1), (2.4, 1.2)]],
)
REGIONS = shrink_world(WORLD, 0.08)
INDEX, REGION, CORNERS = build_edge_index(WORLD), build_edge_index(*REGIONS), corner_table(WORLD)
CORNER_INDEX = build_corner_index(WORLD, INDEX)
RATIO, SPEED = 0.43, 0.7


def places(rng, count, region=REGION):
    """Random places where robots have room, shape (2 count,) [m]."""
    found = []
    while len(found) < count:
        point = rng.uniform(WORLD.bounds[:2], WORLD.bounds[2:])
        if point_is_free(region, *point):
            found.append(point)
    return np.ravel(found)


def test_the_corner_game_is_as_recorded(as_recorded):
    rng, found = np.random.default_rng(1), {}
    for _ in range(400):
        alpha, a = rng.uniform(0.3, 2.9), rng.uniform(0.1, 0.9)
        heading, (cx, cy) = rng.uniform(-np.pi, np.pi), rng.normal(size=2)
        r_p, r_e = rng.uniform(0.1, 3.0), rng.uniform(0.05, 2.0)
        polar = rng.uniform(alpha - np.pi, np.pi, 2)
        points = [
            (cx + r * math.cos(heading + phi), cy + r * math.sin(heading + phi))
            for r, phi in zip((r_p, r_e), polar, strict=True)
        ]
        state = to_corner_frame(*points[0], *points[1], cx, cy, heading, alpha)
        game = *state[:4], alpha, a
        v = a * rng.uniform(-0.7, 0.7, 2)
        short = state[1] < 0.0
        for name, value in {
            "frame": state,
            "angle": free_angle(*rng.normal(size=2), alpha),
            "back": from_corner_frame(*v, heading, alpha, state[4]),
            "margins": margins(*game),
            "region": region(*game),
            "time": escape_time(*game, 1.7),
            "dash": dash(*state[:4], a) if short else 0.0,
            "margin": margin_field(*game),
            "table": table_field(*game),
            "table up": table_field_up(*game),
            "policy": table_evader_policy(*game),
            "evader": evader_policy(*game),
            "pursuer": pursuer_policy(*game, *v),
            "world": [
                corner_field(kind, *points[0], *points[1], cx, cy, heading, alpha, a)
                for kind in (0, 1, 2)
            ],
        }.items():
            found.setdefault(name, []).append(np.ravel(value).astype(float))
    as_recorded({name: np.array(values) for name, values in found.items()})


@pytest.mark.parametrize("alpha", [0.8, 1.9])
def test_maps_of_the_corner_game_are_as_recorded(alpha, as_recorded):
    x, y = np.meshgrid(np.linspace(-1.93, 2.07, 31), np.linspace(-1.87, 2.11, 29))
    points = np.stack([x, y], axis=-1)
    pursuer, evader = np.array([0.81, -0.63]), np.array([-0.57, 0.71])
    as_recorded(partition(pursuer, points, alpha, 0.43), "evaders", relative=1e-9)
    as_recorded(pursuer_partition(evader, points, alpha, 0.43), "pursuers", relative=1e-9)
    as_recorded(inside_obstacle(points, alpha), "obstacle", relative=1e-9)
    for name in FIELDS:
        as_recorded(field_grid(name, evader, points, alpha, 0.43), name)


@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2), (2, 4)])
def test_what_teams_see_and_do_is_as_recorded(n, m, as_recorded):
    rng, found = np.random.default_rng([n, m]), {}
    for _ in range(40):
        p, e = places(rng, n), places(rng, m)
        sight = observe(INDEX, CORNER_INDEX, p, e)
        bodies = observe(INDEX, CORNER_INDEX, p, e, rng.uniform(0.02, 0.2, n + m))
        assignment = rng.integers(-1, m, n).astype(float)
        vectors = rng.integers(0, len(RISK_VECTORS), n)
        field = 0.5 * rng.normal(size=2 * n)
        evading = CORNERS, RATIO, RATIO * SPEED, 0.06
        pursuit = vectors, p, e, sight, assignment, CORNERS, RATIO, SPEED
        for name, value in {
            "sight": sight,
            "past bodies": bodies,
            "risk": team_risk(rng.integers(0, 3, n), e, sight, CORNERS),
            "evading": adversarial_velocities(p, e, sight, *evading),
            "outlooks": escape_outlooks(p, e, sight, *evading),
            "looking ahead": lookahead_velocities(
                REGION, p, e, sight, assignment, CORNERS, RATIO, SPEED
            ),
            **{name: team_pursuit(code, *pursuit, 0.0) for name, code in FIELDS.items()},
            "held": team_pursuit(FIELDS["margin"], *pursuit, 0.9),
            "modified": modified_velocities(0.63, SPEED, 0.45, 0.2, p, e, assignment, field),
            "least": least_escape_time(INDEX, CORNERS, p[:2], e[:2], RATIO, SPEED),
        }.items():
            found.setdefault(name, []).append(np.ravel(value))
    as_recorded({name: np.array(values) for name, values in found.items()})


def test_a_field_over_a_world_is_as_recorded(as_recorded):
    points = places(np.random.default_rng(3), 300, INDEX).reshape(-1, 2)
    for vector, code in RISK_VECTORS.items():
        game = CORNERS, FIELDS["margin"], code, RATIO
        as_recorded(sample_field(INDEX, points, 1.7, 1.2, *game), vector)


# Crowds in which gaps are small, and walls are near.
CROWDS = [(2, 0, 0), (4, 3, 0), (3, 2, 1), (3, 3, -1), (6, 4, 0)]


def crowd(rng, n, m):
    """Positions, radii, other positions and other radii of robots crowded into a corner."""
    radii, spots = rng.uniform(0.04, 0.09, n + m), []
    while len(spots) < n + m:
        middle, spots = places(rng, 1), []
        for point in middle + rng.uniform(-0.55, 0.55, (100, 2)):
            gaps = [np.hypot(*(point - other)) - radii[k] for k, other in enumerate(spots)]
            fits = len(spots) < n + m and point_is_free(REGION, *point)
            if fits and min(gaps, default=np.inf) > radii[len(spots)]:
                spots.append(point)
    spots = np.array(spots)
    return spots[:n].ravel(), radii[:n], spots[n:].ravel(), radii[n:]


@pytest.mark.parametrize(("n", "m", "rank"), CROWDS)
def test_how_robots_keep_off_one_another_is_as_recorded(n, m, rank, as_recorded):
    rng, found = np.random.default_rng([n, m, rank + 1]), {}
    near, room, period = 0.13, 0.21, 0.17
    for _ in range(40):
        p, radii, others, other_radii = crowd(rng, n, m)
        angles = rng.uniform(-np.pi, np.pi, n)
        pace = np.where(rng.random(n) < 0.15, 0.0, rng.uniform(0.2, 0.9, n))
        wished = np.column_stack([pace * np.cos(angles), pace * np.sin(angles)]).ravel()
        turns = rng.uniform(0.1, 1.4, n) * (rng.random(n) < 0.4)
        first = rng.random(n) < (0.4 if rank == 1 else 0.0)
        bodies = radii, others, other_radii
        poses = np.column_stack([p.reshape(-1, 2), rng.uniform(-3, 3, n)]).ravel()
        commands = np.column_stack([rng.uniform(-0.8, 0.8, n), rng.uniform(-4, 4, n)]).ravel()
        limits = np.array([0.6, 3.0])
        waiting = still_waiting(
            rng.uniform(0.0, 2.0, n),
            p - period * wished * np.repeat(rng.uniform(0.0, 0.8, n), 2),
            p,
            wished,
            period,
        )
        for name, value in {
            "avoid": avoid(
                *REGION, p, wished, *bodies, turns, first, rank, near, room, SPEED, period
            ),
            "parts": clear_parts(p, period * wished, *bodies, first, rank, near),
            "robots": stop_at_robots(
                poses, commands, limits, period, 1.4 * period, *bodies, first, rank, near
            ),
            "walls": stop_at_walls(*REGION, poses, commands, limits, period),
            "waiting": waiting,
            "turns": take_turns(turns, waiting, p, radii, others, period),
            "no others": take_turns(turns, waiting, p, radii, np.empty(0), period),
        }.items():
            found.setdefault(name, []).append(np.ravel(value))
    as_recorded({name: np.array(values) for name, values in found.items()}, absolute=1e-7)


def test_gaps_between_robots_are_as_recorded(as_recorded):
    rng = np.random.default_rng(6)
    samples, radii = np.cumsum(rng.normal(scale=0.2, size=(60, 4, 2)), axis=0), [0.2, 0.1, 0.3, 0.4]
    gaps = gaps_between_samples(samples, np.array(radii))
    as_recorded(pair_gaps(samples, np.array(radii)), "samples")
    as_recorded(gaps, "between")
    as_recorded(count_contacts(gaps), "contacts")
    found = []
    for _ in range(30):
        start, end = rng.normal(size=(2, 2))
        paths, contacts = rng.normal(size=(3, 4)), rng.uniform(0.1, 0.5, 3)
        runners = start, end, (0.3, 1.7), paths[:, :2], contacts
        found.append([gap_to_runners(*runners, 0.4), gap_to_runners(*runners, 0.0)])
        found[-1].append(gap_to_paths(start, end, paths, contacts))
    as_recorded(np.array(found), "paths")


def test_how_agents_move_is_as_recorded(as_recorded):
    rng = np.random.default_rng(8)
    poses, wished = rng.normal(size=60), rng.normal(size=40)
    commands = heading_commands(poses, wished, 3.7)
    as_recorded(commands, "commands")
    as_recorded(drive_step(poses, commands, np.array([0.8, 2.1]), 0.31), "drives")
    as_recorded(point_step(wished, wished[::-1].copy(), 0.9, 0.31), "points")
    headings = np.arctan2(wished[1::2], wished[::2])
    headings[:10] += rng.choice([1e-8, -1e-8, np.pi + 1e-8, 1.2e-7, -1.2e-7], 10)
    headings[14:] = rng.uniform(-3, 3, 6)
    as_recorded(turn_first_command(headings, wished.reshape(-1, 2), 0.13), "turning first")


def team_views(seed, n, m, count=25, **options):
    """Random moments of a game."""
    rng = np.random.default_rng([seed, n, m])
    for _ in range(count):
        visible = rng.random((n, m)) < 0.7
        risk = rng.uniform(0.2, 5.0, (n, m)) * visible
        p, e = rng.uniform(0, 4, (n, 2)), rng.uniform(0, 4, (m, 2))
        yield TeamView(visible, risk, p, e, seed=int(rng.integers(1000)), **options)


@pytest.mark.parametrize("extra", ["stay", "riskiest"])
@pytest.mark.parametrize("rule", ASSIGNMENT_RULES)
def test_assignments_are_as_recorded(rule, extra, as_recorded):
    choose = ASSIGNMENT_RULES[rule]
    local, found = decentralised(choose, 1.9), []
    for n, m in ((4, 2), (3, 4), (5, 3)):
        held = None
        for view in team_views(2, n, m, extra=extra):
            found.extend([*choose(view), *local(view)])
            for hold in HOLDS:
                kept = hold_or_choose(view, held, choose, hold)
                found.extend(kept)
            held = kept
    as_recorded([int(each) for each in found], relative=1e-9)


def test_scores_and_small_matchings_are_as_recorded(as_recorded):
    found = []
    for n, m in ((4, 2), (3, 5), (5, 3)):
        for view in team_views(3, n, m):
            for scores in AGGREGATIONS.values():
                found.extend(scores(view.risk, view.visible))
            for greatest in (False, True):
                p, e = view.pursuers.ravel(), view.evaders.ravel()
                ranked = nearer_first(view.risk, p, e, greatest)
                found.extend(1e6 * (ranked - view.risk).ravel())
                found.extend(match_small(ranked, view.visible, greatest))
    as_recorded(np.array(found))


def test_random_starts_are_as_recorded(as_recorded):
    teams = {"pursuers": 3, "evaders": 4, "pursuer_radius": 0.11, "evader_radius": 0.05}
    (pursuing,), (evading,) = shrink_world(WORLD, 0.11), shrink_world(WORLD, 0.05)
    drawn = [draw_starts(WORLD, pursuing, evading, **teams, seed=seed) for seed in range(12)]
    as_recorded(np.array([np.concatenate(each) for each in drawn]))

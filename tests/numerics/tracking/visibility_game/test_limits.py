"""What visibility games are like exactly at their limits, and just beside them."""

import dataclasses
import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game import board as boards
from sightfield.systems.numerics.tracking.visibility_game import bounds, moves_in_sight, sight_rows
from sightfield.systems.numerics.tracking.visibility_game.board import (
    make_board,
    nearest_evader_node,
    nearest_node,
    steps_from_now,
)
from sightfield.systems.numerics.tracking.visibility_game.bounds import team_certificate
from sightfield.systems.numerics.tracking.visibility_game.ground import (
    nodes_by_rim,
    nodes_near,
    nodes_to_follow,
    wall_places,
    without_thin_obstacles,
)
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.lattice import (
    Lattice,
    cover,
    finite_point,
    free_nodes,
    moves_within,
)
from sightfield.systems.numerics.tracking.visibility_game.planes import FOR_EVER
from sightfield.systems.numerics.tracking.visibility_game.responsibilities import (
    AGES,
    NOBODY,
    responsibilities,
    shared_certificate,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders

SQUARE = make_world([(0, 0), (4, 0), (4, 4), (0, 4)])
CORNER = make_world([(0, 0), (2, 0), (2, 2), (1.07, 2), (1.07, 0.96), (0, 0.96)])
SPEEDS = {"pursuer_speed": 1.0, "evader_speed": 0.5}


def refuses(world, here, there, sight_range=math.inf):
    """Whether grids of two spacings are too fine for a world."""
    try:
        bounds._require_few(world, here, there, sight_range, 0.02)
    except InvalidInput:
        return True
    return False


def test_games_of_more_than_twenty_thousand_million_pairs_are_refused():
    for sight_range, seen in ((math.inf, 16.0), (1.0, math.pi), (100.0, 16.0)):
        there = math.sqrt(16.0 * seen / 20e9) / 0.02
        assert not refuses(SQUARE, 0.02, 1.001 * there, sight_range)
        assert refuses(SQUARE, 0.02, 0.999 * there, sight_range)


def test_grids_of_more_than_ten_million_nodes_or_too_many_in_a_row_are_refused():
    # With three nodes more at either end.
    side = math.sqrt(10e6) - 6.0
    assert not refuses(SQUARE, 1.0, 4.0 / (side - 0.1))
    assert refuses(SQUARE, 1.0, 4.0 / (side + 0.1))
    narrow = make_world([(0, 0), (100, 0), (100, 0.5), (0, 0.5)])
    assert not refuses(narrow, 1.0, 100.0 / 32760.9)
    assert refuses(narrow, 1.0, 100.0 / 32761.1)


def test_a_coarser_grid_is_suggested_where_there_is_one():
    with pytest.raises(InvalidInput, match=r"`grid` must be coarser .* world, 0\.022 m say; got 0"):
        bounds._require_few(SQUARE, 0.01, 0.01, math.inf, 0.02)
    with pytest.raises(InvalidInput, match=r"`grid` must be coarser for so large a world; got"):
        bounds._require_few(SQUARE, 1e-320, 1e-320, math.inf, 0.02)


@pytest.mark.parametrize("bound", ["middle", "lower", "upper"])
def test_a_table_that_just_fits_is_solved(bound):
    game = {**SPEEDS, "grid": 0.3, "bound": bound}
    table = solve_visibility_game(CORNER, **game)
    size = float(table.nbytes)
    solve_visibility_game(CORNER, **game, memory=size)
    with pytest.raises(InvalidInput, match="so that the table takes at most"):
        solve_visibility_game(CORNER, **game, memory=size - 1.0)
    if bound == "middle":
        size = table.planes.tiles.nbytes
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(boards, "MEMORY", size)
            make_board(table)
            make_board.cache_clear()
            patch.setattr(boards, "MEMORY", size - 1)
            with pytest.raises(InvalidInput, match="be coarser for pursuit"):
                make_board(table)


def test_a_table_of_two_evaders_that_just_fits_is_solved():
    game = {**SPEEDS, "grid": 0.5}
    table = solve_two_evaders(CORNER, **game)
    solve_two_evaders(CORNER, **game, memory=table.nbytes)
    with pytest.raises(InvalidInput, match="so that the table of two evaders takes at most"):
        solve_two_evaders(CORNER, **game, memory=table.nbytes - 1.0)
    with pytest.raises(InvalidInput, match=r"`speed_ratio` must lie in \(0, 1\); got 1"):
        solve_two_evaders(CORNER, **game | {"evader_speed": 1.0})


@pytest.mark.parametrize("bound", ["middle", "lower", "upper"])
def test_players_are_where_they_have_room(bound):
    table = solve_visibility_game(CORNER, **SPEEDS, grid=0.4, bound=bound)
    # The first is inside the obstacle, far from all nodes, and the others are outside and nowhere.
    for at in ([0.3, 1.7], [-0.5, 0.5], [0.5, math.nan], [0.5, 0.5, 0.5]):
        for name, players in (("pursuer", (at, [1.5, 0.5])), ("evader", ([1.5, 0.5], at))):
            with pytest.raises(InvalidInput, match=f"`{name}` must be "):
                table.time(*players)
        with pytest.raises(InvalidInput, match="`pursuer` must be "):
            table.times_from(at)
    # Out of sight of each other.
    assert table.time([0.2, 0.3], [1.2, 1.8]) == 0.0
    assert table.time([1.5, 0.5], [1.6, 0.6]) > 0.0


def test_three_players_are_where_they_have_room():
    table = solve_two_evaders(CORNER, **SPEEDS, grid=0.5)
    inside, free = [0.3, 1.7], [1.5, 0.5]
    for name, players in (
        ("pursuer", (inside, free, free)),
        ("evader_1", (free, inside, free)),
        ("evader_2", (free, free, inside)),
    ):
        with pytest.raises(InvalidInput, match=f"`{name}` must be "):
            table.time(*players)
    with pytest.raises(InvalidInput, match="`evader` must be "):
        table.times_from(free, inside)
    assert table.time([0.2, 0.3], free, [1.2, 1.8]) == 0.0
    assert table.time([0.2, 0.3], [1.2, 1.8], free) == 0.0
    assert table.time(free, [1.6, 0.6], [1.4, 0.6]) > 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bound": "upper"}, "`bound` must be one of middle, lower; got upper"),
        ({"evader_moves": 13}, "`evader_moves` must be one of 9, 21; got 13"),
        ({"pursuer_speed": 0.0}, "`pursuer_speed` must be positive"),
        ({"evader_speed": 0.0}, "`evader_speed` must be positive"),
        ({"grid": 0.0}, "`grid` must be positive"),
        ({"horizon": 0.0}, "`horizon` must be positive"),
        ({"memory": 0.0}, "`memory` must be positive"),
    ],
)
def test_no_game_has_such_numbers(changes, message):
    with pytest.raises(InvalidInput, match=message):
        solve_two_evaders(CORNER, **SPEEDS | {"grid": 0.5} | changes)
    if "evader_moves" not in changes and "bound" not in changes:
        with pytest.raises(InvalidInput, match=message):
            solve_visibility_game(CORNER, **SPEEDS | {"grid": 0.5} | changes)


@pytest.mark.parametrize("solve", [solve_visibility_game, solve_two_evaders])
def test_both_players_need_a_node(solve):
    closet = make_world([(0.2, 0.2), (0.3, 0.2), (0.3, 0.3), (0.2, 0.3)])
    for role, regions in (
        ("pursuer", {"pursuer_regions": [closet]}),
        ("evader", {"evader_regions": [closet]}),
    ):
        with pytest.raises(InvalidInput, match=f"`grid` must leave the {role} a place; got 0.7"):
            solve(CORNER, **SPEEDS | {"evader_speed": 0.9}, grid=0.7, **regions)


def test_an_evader_exactly_at_the_sight_range_is_seen():
    table = solve_visibility_game(SQUARE, **SPEEDS, grid=0.4, sight_range=1.5)
    assert table.time([1.0, 1.0], [1.0, 2.5]) > 0.0
    assert table.time([1.0, 1.0], [1.0, 2.5 + 1e-6]) == 0.0


def test_the_nearest_node_is_one_of_the_nine_round_a_point():
    frame, one = np.array([0.0, 0.0, 1.0]), np.full((3, 3), -1)
    one[0, 0] = 7
    for x, found in ((1.4, 7), (1.6, -1), (-1.4, 7), (-1.6, -1), (0.0, 7)):
        for at in ((x, x), (x, 0.0), (0.0, x)):
            assert nearest_node(one, frame, *at) == found
    one[:] = np.arange(9).reshape(3, 3)
    # Of several at the same distance the first.
    for at, found in (((0.5, 0.5), 0), ((1.5, 0.5), 1), ((2.0, 1.5), 5), ((2.9, 2.9), 8)):
        assert nearest_node(one, frame, *at) == found
    shifted = np.array([10.0, -3.0, 0.25])
    assert nearest_node(one, shifted, 10.0 + 0.26, -3.0 + 0.49) == 7


def test_the_nearest_evader_node_is_one_of_the_nine_round_a_point():
    board = make_board(solve_visibility_game(CORNER, **SPEEDS, grid=0.3))
    nodes = np.zeros((3, 3), dtype=bool)
    nodes[0, 0] = True
    board = board._replace(evader_nodes=nodes, evader_frame=np.array([0.0, 0.0, 1.0]))
    for x, found in ((1.4, (0, 0)), (1.6, (-1, -1)), (-1.4, (0, 0)), (-1.6, (-1, -1))):
        for at in ((x, x), (x, 0.0), (0.0, x)):
            assert nearest_evader_node(board, *at) == found
    board.evader_nodes[:] = True
    for at, found in (((0.5, 0.5), (0, 0)), ((1.5, 0.5), (0, 1)), ((2.9, 1.5), (1, 2))):
        assert nearest_evader_node(board, *at) == found
    board = board._replace(evader_frame=np.array([10.0, -3.0, 0.25]))
    assert nearest_evader_node(board, 10.26, -2.51) == (2, 1)


def test_steps_count_from_now():
    counted = [steps_from_now(steps) for steps in (0, 1, 254, FOR_EVER)]
    assert counted == [0.0, 2.0, 255.0, math.inf]


def test_shares_change_for_a_tenth_and_three_steps():
    seen, two = np.ones((2, 1), bool), np.zeros((2, 1, 1))
    for other, owner in ((12.49, 0), (12.5, 0), (12.51, 1)):
        one = np.array([[10.0], [other]])
        assert responsibilities(one, two, seen, np.array([0]), 0.5).tolist() == [owner]
    # An evader that nobody sees keeps its pursuer, and one that nobody had gets one.
    assert responsibilities(one, two, ~seen, np.array([1]), 0.5).tolist() == [1]
    assert responsibilities(one, two, seen, np.array([NOBODY]), 0.5).tolist() == [1]
    for time, certified in ((AGES, math.inf), (0.999 * AGES, 0.999 * AGES)):
        assert shared_certificate(np.array([[time]]), two[:1], np.array([0])) == certified
    assert shared_certificate(np.array([[AGES]]), two[:1], np.array([NOBODY])) == 0.0


def test_a_team_lasts_as_long_as_its_best_for_the_worst():
    times = np.array([3.0, math.inf, 5.0])
    assert team_certificate(times, np.array([0.0, 1.0, 0.0]), 2) == 5.0
    assert team_certificate(times, np.array([0.0, 1.0, -1.0]), 2) == 3.0
    assert team_certificate(times, np.array([-1.0, 1.0, 1.0]), 2) == 0.0


def test_a_grid_covers_a_rectangle_exactly_where_its_cells_do():
    assert cover(np.array([0.0, 1.0, 4.0, 3.0]), 0.1) == pytest.approx((0.05, 1.05, 0.1, 20, 40))
    assert cover(np.array([0.0, 1.0, 4.01, 3.0]), 0.1)[3:] == (20, 42)
    margin = cover(np.array([0.0, 1.0, 4.0, 3.0]), 0.1, 0.2)
    assert margin == pytest.approx((-0.15, 0.85, 0.1, 24, 44))
    assert moves_within(5).halves.tolist() == [1, 2, 2, 2, 1]
    assert len(moves_within(4).offsets) == 13
    assert moves_within(9).longest == 3.0


@pytest.mark.parametrize("point", [[1.0], [1.0, 2.0, 3.0], [1.0, math.nan], [math.inf, 0.0]])
def test_what_is_no_point_is_refused(point):
    with pytest.raises(InvalidInput, match=r"`evader` must be a finite point \[x, y\]"):
        finite_point("evader", point)


def test_nodes_on_a_wall_stand_for_it_and_those_a_cell_away_do_not():
    index, grid = build_edge_index(SQUARE), Lattice(0.0, 0.0, 0.5, 9, 9)
    free = free_nodes(grid, index)
    found = wall_places(grid, free, index, 2.0)
    # All but the ends of the four walls.
    assert len(found.points) == 4 * 7
    assert grid.at(*found.nodes.T) == pytest.approx(found.points)
    assert np.hypot(*found.along.T) == pytest.approx(np.ones(28))
    inwards = np.column_stack([-found.along[:, 1], found.along[:, 0]])
    assert ((2.0 - found.points) * inwards).sum(axis=1) == pytest.approx(np.full(28, 2.0))
    # A wall of less than two steps is none.
    assert len(wall_places(grid, free, index, 2.0 + 1e-9).points) == 0
    # Half a cell aside they stand for it, too.
    beside = wall_places(Lattice(0.25, 0.25, 0.5, 8, 8), np.ones((8, 8), bool), index, 1.0)
    assert len(beside.points) == 4 * 8
    assert np.isin(np.round(beside.points, 9), [0.0, 4.0]).any(axis=1).all()


def test_walls_thinner_than_two_steps_have_no_places_beside_them():
    def places(thickness, reach):
        sides = [(1, 1), (3, 1), (3, 1 + thickness), (1, 1 + thickness)]
        index, grid = (
            build_edge_index(make_world(SQUARE.boundary, [sides])),
            cover(SQUARE.bounds, 0.2),
        )
        found = wall_places(grid, free_nodes(grid, index), index, reach)
        inner = (found.points > 0.5).all(axis=1) & (found.points < 3.5).all(axis=1)
        return int(inner.sum())

    assert places(0.5, 0.24) > 15
    assert places(0.5, 0.26) == 0


def test_only_obstacles_that_are_too_thin_are_grown():
    box = [(1, 1), (2, 1), (2, 3), (1, 3)]
    world = make_world(SQUARE.boundary, [box])
    assert without_thin_obstacles(world, 1.0) == (world,)
    (grown,) = without_thin_obstacles(world, 1.2)
    assert grown.free_area == pytest.approx(16.0 - 1.2 * 2.2)
    with pytest.raises(InvalidInput, match="`grid` must be finer, so that obstacles leave room"):
        without_thin_obstacles(world, 9.0)


def test_nodes_within_the_slack_of_a_region_are_followed():
    grid = Lattice(-2.0, -2.0, 0.5, 17, 17)
    near = nodes_near(grid, [SQUARE], 0.5)
    x, y = np.moveaxis(grid.points, -1, 0)
    beyond = np.hypot(np.maximum(np.abs(x - 2) - 2, 0), np.maximum(np.abs(y - 2) - 2, 0))
    assert (near == (beyond <= 0.5)).all()
    inside = np.minimum(np.minimum(x, 4 - x), np.minimum(y, 4 - y))
    apart = np.where(inside >= 0, inside, beyond)
    assert (nodes_by_rim(grid, [SQUARE], 1.0) == (apart <= 1.0)).all()
    follow, spots = nodes_to_follow(grid, [SQUARE], 0.5)
    assert (follow == near).all()
    # Discs that a wall cuts have a point in the region each.
    cut = np.zeros_like(near)
    cut[tuple(spots.nodes.T)] = True
    rim = np.isclose(beyond, 0.5)
    assert (cut[~rim] == (near & (apart <= 0.5))[~rim]).all()
    assert cut.sum() == len(spots.points)
    assert (spots.points >= 0.0).all()
    assert (spots.points <= 4.0).all()


def test_who_is_near_the_shadow_of_a_corner():
    near = sight_rows._is_near_ray
    assert near(1.0, 0.49, 1.0, 0.0, 0.5, 0.25)
    assert not near(1.0, 0.5, 1.0, 0.0, 0.5, 0.25)
    assert not near(0.0, 0.25, 1.0, 0.0, 0.5, 0.25)
    assert near(0.0, 0.24, 1.0, 0.0, 0.5, 0.25)
    assert not near(-0.25, 0.0, 1.0, 0.0, 0.5, 0.25)
    assert not near(-1.0, 0.1, 1.0, 0.0, 0.5, 0.25)
    far = moves_in_sight._is_far_from_ray
    assert far(1.0, 0.5, 1.0, 0.0, 0.5)
    assert not far(1.0, 0.49, 1.0, 0.0, 0.5)
    assert far(-0.3, -0.4, 1.0, 0.0, 0.5)
    assert not far(-0.3, -0.39, 1.0, 0.0, 0.5)


def test_corners_within_a_step_or_three_are_close():
    close = sight_rows.is_close
    assert [close(*at, 1.0) for at in ((9.0, 1.0), (9.0, 1.01), (3.0, 2.0), (3.01, 2.0))] == [
        True,
        False,
        True,
        False,
    ]


def test_how_far_a_shadow_bulges_while_a_pursuer_goes():
    s = np.linspace(0.0, 1.0, 200_001)
    for k in (0.1, 0.43, 0.9):
        most = (k * s * (1 - s) / (1 - k * s)).max()
        assert sight_rows._bulge(k) == pytest.approx(most, rel=1e-6)


def test_a_row_near_a_ray_holds_all_nodes_near_it():
    rng = np.random.default_rng(2)
    lattice = -1.0, -2.0, 0.13, 40, 50
    x = -1.0 + 0.13 * np.arange(50)
    for _ in range(300):
        (cx, cy), angle, width = (
            rng.uniform(-1, 3, 2),
            rng.uniform(-np.pi, np.pi),
            rng.uniform(0, 1),
        )
        angle = rng.choice([0.0, np.pi]) if rng.random() < 0.1 else angle
        ux, uy, j = np.cos(angle), np.sin(angle), int(rng.integers(40))
        begin, end = sight_rows.row_by_ray(cx, cy, ux, uy, lattice, width, j)
        dx, dy = x - cx, -2.0 + 0.13 * j - cy
        along = np.maximum(dx * ux + dy * uy, 0.0)
        near = np.flatnonzero(np.hypot(dx - along * ux, dy - along * uy) <= width)
        assert 0 <= begin <= end <= 50
        assert ((near >= begin) & (near < end)).all()
        # Rows that the strip does not meet have none.
        if abs(uy) < 1e-12 and abs(dy) > width:
            assert begin == end


def test_an_evader_is_followed_on_all_nodes_within_the_slack():
    table = solve_visibility_game(CORNER, **SPEEDS, grid=0.4)
    grid = Lattice(0.0, 0.5, 0.25, 6, 7)
    table = dataclasses.replace(table, evader_grid=grid, evader_nodes=np.ones((6, 7), dtype=bool))
    beside = {(0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)}
    for row, column in ((2, 3), (0, 0), (5, 6), (0, 6), (5, 0)):
        found = table._nodes_near(grid.at(row, column))
        expected = {(row + down, column + right) for down, right in beside}
        assert found[0] == (row, column)
        assert len(found) == len(set(found))
        assert set(found) == {each for each in expected if 0 <= each[0] < 6 and 0 <= each[1] < 7}
    # Outside, but within the slack of the grid, and beyond it.
    assert table._nodes_near(np.array([-0.25, 0.5])) == [(0, 0)]
    assert table._nodes_near(np.array([0.0, 2.0])) == [(5, 0)]
    assert table._nodes_near(np.array([1.75, 1.75])) == [(5, 6)]
    assert table._nodes_near(np.array([-0.26, 0.5])) == []
    assert table._nodes_near(np.array([-9.0, -9.0])) == []

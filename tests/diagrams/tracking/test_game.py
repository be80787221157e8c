"""A game is set up from a scenario, or refused with the key that is wrong."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.tracking.solved_game import solved_game
from sightfield.systems.numerics.errors import InvalidInput


def load(name="thesis_3v4", *settings):
    return load_scenario(TrackingScenario, find_scenario(name), settings)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("evaders.positions.0=[1.0, 1.0]", r"`evaders.positions.0` must be in free space"),
        ("pursuers.positions.1=[9, 9]", r"`pursuers.positions.1` must be in free space; got \[9"),
        ("evaders.positions.0=[1.5, 1]", r"`evaders.positions.0` must keep the radius of 0.16 m"),
        ("evaders.positions.0=[3.0, 1.8]", r"must not be the spot of evaders.positions.0; got"),
        ("evaders.positions.0=[2.0, 1.3]", r"must not be the spot of pursuers.positions.0"),
        ("evaders.positions.0=[0.4, 3.0]", r"`evaders.positions.0` must be in sight of a"),
        ("evaders.positions.0=[.nan, 1]", r"`evaders.positions.0` must be a finite number; got"),
        ("evaders.positions.0=[1]", r"`evaders.positions.0` must be \[x, y\]"),
        ("world.obstacles.0=[[0, 0], [1, 1], [1, 0], [0, 1]]", "must not cross itself"),
        ("world.obstacles.0=[[3, 3], [5, 3], [5, 5]]", "must lie inside the boundary"),
        ("world.obstacles.0=[]", "must be a list of .*no points"),
        ("world.boundary=[]", "`world.boundary` must be given"),
        ("world.file=nowhere.wkt", "`world.boundary`.*got both"),
        ("pursuers.radius=2.5", "`pursuers.radius` must leave free space"),
        ("evaders.radius=2.5", "`evaders.radius` must leave free space"),
        ("pursuers.positions=[]", "`pursuers.positions` must name every member"),
        (
            "pursuers.count=2",
            "`pursuers.positions` must name every member.*3 positions and count 2",
        ),
        ("pursuers.count=-3", "`pursuers.count` must be zero or positive; got -3"),
        ("evaders.policies=[flee]", "`evaders.policies` must be one of adversarial"),
        ("evaders.policies=[waypoints]", "`evaders.waypoints.0` must have a point"),
        ("evaders.policies=[you]", "must have you drive one evader at most"),
        ("pursuers.headings=[0]", "`pursuers.headings` must have 3 entries or none"),
        ("pursuers.risk_vectors=[uniform, majority]", "must have 1 or 3 entries"),
        ("evaders.top_speed=0.3", "`evaders.top_speed` must be below pursuers.top_speed"),
        ("pursuers.radio_range=-1", "`pursuers.radio_range` must be zero or positive; got -1"),
        ("period=0", "`period` must be positive; got 0"),
        ("seconds=1e300", "`seconds` must be at most 86400 s; got 1e"),
        ("pursuers.top_speed=1e300", "`pursuers.top_speed` must be at most 100 m/s; got 1e"),
        ("pursuers={top_speed: 1, count: 101}", "`pursuers.count` must be at most 100; got 101"),
        ("period=100", "`period` must be at most `seconds`"),
        ("seed=-1", "`seed` must be zero or positive; got -1"),
    ],
)
def test_what_cannot_be_played_is_refused(setting, message):
    with pytest.raises(InvalidInput, match=message) as caught:
        set_up_game(load("thesis_3v4", setting))
    assert "\n" not in str(caught.value)


def test_more_evaders_than_kemeny_can_rank_are_refused():
    many = ["evaders.positions=[]", "evaders.count=13", "pursuers.positions=[]"]
    many += ["pursuers.count=3", "pursuers.headings=[]"]
    assert load("thesis_3v4", *many).evaders.size == 13
    with pytest.raises(InvalidInput, match="`evaders` must be at most 12 for kemeny_max; got 13"):
        load("thesis_3v4", *many, "pursuers.assignment=kemeny_max")


def test_pursuers_may_share_a_spot_as_alternatives_only():
    assert set_up_game(load("risk_vectors")).pursuer_starts.shape == (3, 3)
    with pytest.raises(InvalidInput, match=r"must not be the spot of pursuers.positions.0"):
        set_up_game(load("risk_vectors", "pursuers.alternatives=false"))


@pytest.mark.parametrize("seed", range(20))
def test_random_starts_are_free_apart_and_seen(seed):
    scenario = with_random_starts(load("thesis_3v4", f"seed={seed}"))
    game = set_up_game(scenario)
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])[:, :2]
    obstacles = game.world.polygon.exterior.union(shapely.MultiLineString(game.world.obstacles))
    assert shapely.distance(obstacles, shapely.points(starts)).min() >= 0.16
    gaps = np.hypot(*(starts[:, None] - starts[None]).transpose(2, 0, 1)) + 9 * np.eye(7)
    assert gaps.min() >= 0.32
    lines = [[shapely.LineString([p, e]) for p in starts[:3]] for e in starts[3:]]
    assert all(any(game.world.polygon.covers(line) for line in each) for each in lines)


def test_random_starts_are_the_seeds():
    scenario = with_random_starts(load())
    first, again = set_up_game(scenario), set_up_game(scenario)
    other = set_up_game(replace(scenario, seed=1))
    np.testing.assert_array_equal(first.evader_starts, again.evader_starts)
    assert not np.array_equal(first.evader_starts, other.evader_starts)


def test_games_of_bodies_in_one_world_share_what_is_solved_for_it():
    # A table of a large map takes hundreds of megabytes, and each game held its own.
    scenario = load("thesis_3v4", "pursuers.grid=0.4")
    world = scenario.world.load()
    tables = [
        solved_game(set_up_game(replace(with_random_starts(scenario), seed=seed), world))
        for seed in (1, 2)
    ]
    assert tables[0] is tables[1]


def test_waypoints_do_not_follow_into_another_world():
    with pytest.raises(InvalidInput, match="not be waypoints in another world"):
        with_random_starts(load("risk_vectors"))


def test_a_start_that_touches_a_wall_is_moved_off_it():
    game = set_up_game(load("thesis_3v4", "evaders.positions.0=[1.9, 0.16]"))
    start = game.evader_starts[0, :2]
    np.testing.assert_allclose(start, [1.9, 0.16], atol=1e-4)
    assert start[1] > 0.16

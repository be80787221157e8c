"""What is guaranteed at the start: the best matching by trying all, and the game of two itself."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from sightfield.diagrams.studies.play import guarantees_of_study
from sightfield.diagrams.studies.team_studies import policies_study, thesis_base
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.solved_game import solved_game, solved_game_of_two
from sightfield.systems.numerics.geometry.random_arena import Arena

RUNS = 6


@pytest.fixture(scope="module")
def study():
    base = thesis_base(5.0)
    base = replace(base, pursuers=replace(base.pursuers, grid=0.2, grid_of_two=0.4))
    return policies_study(
        runs=RUNS,
        base=base,
        arena=Arena(),
        sizes=("1v1", "2v2", "3v2", "1v2"),
        opponents=("adversarial",),
        pursuers=("thesis",),
        starts=2,
    )


@pytest.fixture(scope="module")
def guaranteed(study):
    return guarantees_of_study(study, RUNS)


@pytest.mark.parametrize("size", ["1v1", "2v2", "3v2"])
def test_a_team_is_promised_what_its_best_matching_is(study, guaranteed, size):
    cell = study.cell(f"{size}-thesis-adversarial")
    for run in range(RUNS):
        game = set_up_game(study.scenario(cell, run))
        table = solved_game(game)
        pursuers, evaders = game.pursuer_starts[:, :2], game.evader_starts[:, :2]
        times = np.array([[table.time(p, e) for e in evaders] for p in pursuers])
        ways = permutations(range(len(pursuers)), len(evaders))
        best = max(min(times[i, j] for j, i in enumerate(way)) for way in ways)
        assert guaranteed[size][run] == pytest.approx(best)
    assert np.isfinite(guaranteed[size]).any()


def test_one_pursuer_is_promised_what_the_game_of_two_is_worth(study, guaranteed):
    cell = study.cell("1v2-thesis-adversarial")
    for run in range(RUNS):
        game = set_up_game(study.scenario(cell, run))
        value = solved_game_of_two(game).time(
            game.pursuer_starts[0, :2], *game.evader_starts[:, :2]
        )
        assert guaranteed["1v2"][run] == pytest.approx(value)
    assert np.isfinite(guaranteed["1v2"]).all()
    assert (guaranteed["1v2"] > 0.0).any()


def test_nothing_is_lost_where_nothing_hides():
    base = thesis_base(5.0)
    empty = policies_study(
        runs=1,
        base=replace(base, pursuers=replace(base.pursuers, grid=0.4)),
        arena=Arena(obstacles=0),
        sizes=("3v2",),
        opponents=("adversarial",),
    )
    assert np.isinf(guarantees_of_study(empty, 1)["3v2"]).all()

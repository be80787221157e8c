"""What a study is made of, and the games that it consists of."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import load_scenario
from sightfield.diagrams.studies.play import play, play_block
from sightfield.diagrams.studies.report import write_scenario
from sightfield.diagrams.studies.study import Cell, study_from_json, study_to_json
from sightfield.diagrams.studies.team_studies import (
    assignment_study,
    policies_study,
    thesis_base,
    tracking_study,
)
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.random_arena import Arena
from sightfield.systems.numerics.geometry.team_sight import sight_matrix


def test_a_study_survives_json(make_study):
    study = make_study(3)
    assert study_from_json(json.loads(json.dumps(study_to_json(study)))) == study


@pytest.mark.parametrize("make", [tracking_study, assignment_study, policies_study])
def test_worlds_are_drawn_unless_one_is_given(make):
    base, arena = thesis_base(seconds=7.0), Arena(side=5.0)
    assert make(runs=1).arena == Arena()
    assert make(runs=1, arena=arena).arena is arena
    assert make(runs=1, base=base).arena is None
    both = make(runs=1, base=base, arena=arena)
    assert (both.base, both.arena) == (base, arena)


def test_every_evader_starts_where_a_pursuer_sees_it():
    study = tracking_study(runs=4)
    for cell in study.cells[:16]:
        for run in range(study.runs):
            game = set_up_game(study.scenario(cell, run))
            pursuers, evaders = game.pursuer_starts[:, :2], game.evader_starts[:, :2]
            assert (len(pursuers), len(evaders)) == tuple(map(int, cell.name[:3].split("v")))
            seen = sight_matrix(build_edge_index(game.world), pursuers.ravel(), evaders.ravel())
            assert seen.reshape(len(pursuers), -1).any(axis=0).all()


def test_cells_share_worlds_and_starts_run_by_run():
    study = tracking_study(runs=2, sizes=(1, 3))
    games = {cell.name: set_up_game(study.scenario(cell, 1)) for cell in study.cells}
    first, other_vector = games["3v3-uniform-adversarial"], games["3v3-majority-adversarial"]
    np.testing.assert_array_equal(first.pursuer_starts, other_vector.pursuer_starts)
    np.testing.assert_array_equal(first.evader_starts, other_vector.evader_starts)
    other_evaders = games["3v3-uniform-best_response"]
    np.testing.assert_array_equal(first.evader_starts, other_evaders.evader_starts)
    np.testing.assert_array_equal(first.world.boundary, other_evaders.world.boundary)
    fewer = games["3v1-uniform-adversarial"]
    np.testing.assert_array_equal(first.pursuer_starts, fewer.pursuer_starts)
    np.testing.assert_array_equal(first.evader_starts[:1], fewer.evader_starts)
    np.testing.assert_array_equal(first.world.boundary, fewer.world.boundary)
    another = set_up_game(study.scenario(study.cell("3v3-uniform-adversarial"), 0))
    assert not np.array_equal(first.pursuer_starts, another.pursuer_starts)


def test_a_run_does_not_depend_on_the_study_around_it(make_study):
    """Neither on other cells nor on the number of runs, nor on the block that it is played in."""
    study = make_study(5)
    alone = replace(study, cells=study.cells[1:2], runs=3)
    whole, part = play_block(study, 0, 4), play_block(alone, 2, 3)
    row = [k for k in range(12) if (whole["cell"][k], whole["run"][k]) == ("1v2", 2)]
    assert {name: [whole[name][k] for k in row] for name in whole} == part


def test_a_run_replayed_alone_gives_the_time_in_the_table(make_study, tmp_path):
    """By the logging run of `sightfield track`, from the scenario file."""
    study = make_study(2)
    rows = play_block(study, 0, 2)
    for k in range(6):
        cell = study.cell(rows["cell"][k])
        write_scenario(study.scenario(cell, rows["run"][k]), tmp_path / "scenario.yaml")
        scenario = load_scenario(TrackingScenario, tmp_path / "scenario.yaml")
        run = run_tracking(set_up_game(scenario))
        assert run.tracking_time == rows["time"][k]
        lost = -1 if run.lost_evader is None else run.lost_evader
        assert lost == rows["lost_evader"][k]
        assert (lost < 0) == rows["censored"][k]


@pytest.mark.parametrize("seconds", [0.73, 2.0])
def test_a_game_without_a_loss_lasts_to_the_horizon_exactly(make_study, seconds):
    """Even where that is no whole number of periods: one evader that waits in plain sight."""
    scenario = replace(
        make_study(1).base,
        seconds=seconds,
        world=WorldSource(boundary=[[0, 0], [4, 0], [4, 4], [0, 4]]),
    )
    assert play(set_up_game(scenario)) == (seconds, -1)


def test_games_in_a_world_of_their_own_are_played_there(make_study, tmp_path):
    (tmp_path / "room.wkt").write_text("POLYGON ((0 0, 4 0, 4 2, 2 2, 2 4, 0 4, 0 0))")
    base = thesis_base(1.0, WorldSource(file=str(tmp_path / "room.wkt")))
    study = make_study(2, base=base, arena=None)
    for cell in study.cells:
        assert set_up_game(study.scenario(cell, 0)).world.vertex_count == 6
    assert len(play_block(study, 0, 2)["time"]) == 6


def test_a_cell_that_has_fewer_runs_has_no_others(make_study):
    study = make_study(6)
    assert [study.runs_of(cell) for cell in study.cells] == [6, 6, 4]
    assert study.games(0, 6) == 16
    assert study.games(3, 5) == 5
    with pytest.raises(InvalidInput, match="`run` must lie between 0 and 3; got 4"):
        study.scenario(study.cells[2], 4)


def test_a_cell_knows_what_it_sets():
    cell = Cell(name="a", settings=("evaders.count=2", "pursuers.risk_vectors=[uniform]"))
    assert cell.value("evaders.count") == 2
    assert cell.value("pursuers.risk_vectors") == ["uniform"]
    assert cell.value("pursuers.count") is None


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"runs": 0}, "`runs` must be positive"),
        ({"seed": -1}, "`seed` must be zero or positive"),
        ({"cells": ()}, "`cells` must hold one at least"),
        ({"cells": (Cell(name="a"), Cell(name="a"))}, "`cells` must have a name each; got a twice"),
        ({"cells": (Cell(name="a", runs=2),)}, "`cell` must have 1 to 1 runs.*; got 2 in cell a"),
        ({"cells": (Cell(name="a", runs=0),)}, "`cell` must have 1 to 1 runs.*; got 0 in cell a"),
        ({"cells": (Cell(name="a", settings=("pace=1",)),)}, r"`pace` must be a key .*in cell a"),
        ({"cells": (Cell(name="a", settings=("seconds=x",)),)}, r"`seconds` must be .*in cell a"),
    ],
)
def test_an_impossible_study_is_refused_before_it_starts(make_study, changes, complaint):
    with pytest.raises(InvalidInput, match=complaint):
        make_study(**{"runs": 1, **changes})


def test_names_that_files_and_commands_cannot_hold_are_refused():
    with pytest.raises(InvalidInput, match="`cell` must be named by letters"):
        Cell(name="a/b:c")


def test_a_game_that_cannot_be_set_up_names_its_cell_and_run(make_study):
    crowd = Cell(name="crowd", settings=("evaders.count=40", "evaders.radius=0.6"))
    with pytest.raises(InvalidInput, match=r"no room.*\(in cell crowd, run 0\)"):
        play_block(make_study(1, cells=(crowd,)), 0, 1)


def test_runs_may_share_an_arena(make_study):
    study = make_study(6, starts_per_arena=3)
    worlds = [study.drawn_world(run) for run in range(6)]
    same = [np.array_equal(worlds[0].obstacles[0], each.obstacles[0]) for each in worlds]
    assert same == [True] * 3 + [False] * 3
    alone = replace(study, starts_per_arena=1)
    np.testing.assert_array_equal(alone.drawn_world(0).obstacles[0], worlds[0].obstacles[0])
    # Starts differ, and the game of a run is the same in a block and alone.
    cell = study.cells[0]
    rows = play_block(study, 1, 5)
    times = [play(set_up_game(study.scenario(cell, run)))[0] for run in range(1, 5)]
    assert [t for c, t in zip(rows["cell"], rows["time"], strict=True) if c == cell.name] == times
    assert len(set(times)) > 1
    with pytest.raises(InvalidInput, match="`starts_per_arena` must be positive"):
        replace(study, starts_per_arena=0)

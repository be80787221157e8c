"""Reports, claims and pictures of studies whose times are made up are as they were recorded."""

import numpy as np
import pytest

from sightfield.diagrams.studies import map_study, report, team_studies, thesis_claims
from sightfield.diagrams.studies.claims import variants
from sightfield.diagrams.studies.map_study import Kept, MapResult, MapStudy
from sightfield.diagrams.studies.opponents import runs_in_words
from sightfield.diagrams.studies.summary import mean_tables, summarise_study, to_markdown

RUNS = {"adversarial": 14, "best_response": 9}
OPPONENTS = tuple(RUNS)


def made_up_times(cell, rng):
    """Longer with pursuers and shorter with evaders, beyond the horizon now and then."""
    n, m = cell.value("pursuers.count"), cell.value("evaders.count")
    scale = 75.0 * n**0.4 / m**0.7 + len(cell.name) % 7
    return scale * rng.gamma(2.0, 0.5, 20)


STUDIES = {
    "tracking": (
        team_studies.tracking_study(
            sizes=(1, 3), opponents=OPPONENTS, opponent_runs=RUNS, vectors=("uniform", "majority")
        ),
        team_studies.tracking_grid,
    ),
    "assignment": (
        team_studies.assignment_study(sizes=(1, 2, 4), opponents=OPPONENTS, opponent_runs=RUNS),
        team_studies.assignment_grid,
    ),
    "policies": (
        team_studies.policies_study(
            sizes=("1v1", "2v3"),
            opponents=OPPONENTS,
            opponent_runs=RUNS,
            pursuers=("thesis", "margin"),
        ),
        team_studies.policies_grid,
    ),
}


@pytest.mark.parametrize("name", STUDIES)
def test_a_report_is_as_recorded(name, made_up, drawn, as_recorded):
    study, grid_of = STUDIES[name]
    result, grid = made_up(study, made_up_times), grid_of(study)
    summary = summarise_study(result, grid)
    as_recorded(summary if name == "policies" else list(summary), "summary")
    as_recorded(to_markdown(mean_tables(summary, grid)), "tables")
    as_recorded(runs_in_words(study), "runs")
    as_recorded([(cell.name, cell.settings, cell.runs) for cell in study.cells[::5]], "cells")
    draws = {"matrix": report.draw_matrix, "curves": report.draw_curves}
    draws |= {"means": report.draw_means} if grid.means else {}
    for what, draw in draws.items():
        if name == "policies" or what != "curves":
            as_recorded(drawn(draw(result, grid)), what)


def test_judgements_of_teams_are_as_recorded(made_up, as_recorded):
    study = team_studies.tracking_study(
        sizes=(1, 3),
        opponents=OPPONENTS,
        opponent_runs=RUNS,
        vectors=tuple(thesis_claims.VECTORS),
    )
    judged = thesis_claims.judge_teams(made_up(study, made_up_times))
    as_recorded([(each.claim, each.verdict, each.evidence, each.against) for each in judged])


def test_judgements_of_allocations_are_as_recorded(made_up, as_recorded):
    study = team_studies.assignment_study(
        sizes=(1, 2, 4), opponents=OPPONENTS, opponent_runs=RUNS, rules=thesis_claims.TEAMS
    )
    result = made_up(study, made_up_times)
    for horizon in (None, 80.0):
        judged = thesis_claims.judge_allocations(result, horizon)
        told = [(each.claim, each.verdict, each.evidence, each.against) for each in judged]
        as_recorded(told, f"to {horizon}")


def test_what_is_varied_is_as_recorded(as_recorded):
    as_recorded([vars(each) for each in (*variants(), *variants(few=True))])
    as_recorded(team_studies.thesis_base(7.0), "base")


@pytest.mark.parametrize("arenas", [1, 5])
def test_a_report_on_maps_is_as_recorded(arenas, drawn, as_recorded):
    study = MapStudy(
        values={
            "size": (0.2, 0.5),
            "gap": (0.2, 0.3, 0.45),
            "speed_ratio": (0.2, 0.7),
            "pieces": (2.0, 7.0),
        }
    )
    rng = np.random.default_rng(arenas)
    found = {
        factor: {
            value: tuple(Kept(*rng.uniform(0.5, 1.0, 2).tolist()) for _ in range(arenas))
            for value in values
        }
        for factor, values in study.values.items()
    }
    result = MapResult(study, found)
    summary = map_study.summarise_maps(result) | {"arenas": arenas}
    as_recorded(summary, "summary")
    as_recorded(to_markdown(map_study.map_tables(summary)), "tables")
    as_recorded(drawn(map_study.draw_maps(result)), "picture")


def test_settings_of_maps_are_as_recorded(as_recorded):
    study = MapStudy()
    told = {
        f"{factor} {value}": study.setting(factor, value)
        for factor, values in map_study.VALUES.items()
        for value in values
    }
    as_recorded(told)

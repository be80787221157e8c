"""The thesis's studies: their cells, and how they are shown and compared."""

import numpy as np
import pyarrow as pa
import pytest

from sightfield.diagrams.studies.opponents import (
    Match,
    cell_name,
    fewer_runs,
    match_of,
    read_opponent_runs,
    runs_in_words,
)
from sightfield.diagrams.studies.records import SCHEMA, StudyResult
from sightfield.diagrams.studies.report import draw_curves, draw_matrix, draw_means
from sightfield.diagrams.studies.summary import mean_tables, summarise_study, to_markdown
from sightfield.diagrams.studies.team_studies import (
    assignment_grid,
    assignment_study,
    policies_grid,
    policies_study,
    tracking_grid,
    tracking_study,
)
from sightfield.systems.numerics.errors import InvalidInput

STUDIES = {"tracking": (tracking_study, tracking_grid)}
STUDIES["assignment"] = (assignment_study, assignment_grid)
STUDIES["policies"] = (policies_study, policies_grid)
OPPONENTS = ("adversarial", "best_response")


@pytest.mark.parametrize("name", STUDIES)
def test_every_cell_is_drawn_once_in_each_picture(name):
    make, grid_of = STUDIES[name]
    study = make(runs=1)
    grid = grid_of(study)
    cells = sorted(cell.name for cell in study.cells)
    for panels in (grid.means, grid.curves) if grid.means else (grid.curves,):
        shown = [cell for p in panels for some in p.series.values() for cell in some.values()]
        assert sorted(shown) == cells
    in_matrix = [
        cell for rows in grid.matrix.values() for row in rows.values() for cell in row.values()
    ]
    assert sorted(in_matrix) == cells
    assert {cell for pair in grid.pairs for cell in pair} == set(cells)
    assert len(set(map(frozenset, grid.pairs))) == len(grid.pairs)


@pytest.mark.parametrize("name", STUDIES)
def test_only_the_pursuers_differ_between_cells_that_are_compared(name):
    make, grid_of = STUDIES[name]
    study = make(runs=3, opponent_runs={"best_response": 2})
    for first, second in grid_of(study).pairs:
        one, other = study.cell(first), study.cell(second)
        keys = {
            a.partition("=")[0] for a, b in zip(one.settings, other.settings, strict=True) if a != b
        }
        assert keys
        assert all(key.startswith("pursuers.") for key in keys)
        assert "pursuers.count" not in keys
        assert study.runs_of(one) == study.runs_of(other)


@pytest.mark.parametrize("name", STUDIES)
def test_a_cell_plays_whom_its_name_and_title_say(name):
    make, grid_of = STUDIES[name]
    study = make(runs=3, opponent_runs={"best_response": 2})
    grid = grid_of(study)
    for cell in study.cells:
        scenario = study.scenario(cell, 0)
        pursuers, evaders, variant, opponent = match_of(cell.name)
        assert scenario.evaders.policies == [opponent]
        assert (scenario.pursuers.size, scenario.evaders.size) == (pursuers, evaders)
        assert grid.matrix[f"{pursuers}v{evaders}"][variant][opponent] == cell.name
        assert study.runs_of(cell) == (2 if opponent == "best_response" else 3)
    for panel in (*grid.means, *grid.curves):
        for series in panel.series.values():
            assert {match_of(cell).opponent for cell in series.values()} == {
                panel.title.split()[-1]
            }


def test_names_of_cells_are_read_as_they_were_made():
    match = Match(12, 3, "with-a-hyphen", "best_response")
    assert cell_name(*match) == "12v3-with-a-hyphen-best_response"
    assert match_of(cell_name(*match)) == match


def test_the_thesis_and_five_others_pursue_in_the_study_of_policies():
    study = policies_study(runs=1, sizes=("3v4",), opponents=("adversarial",))
    rules = {match_of(cell.name).variant: study.scenario(cell, 0).pursuers for cell in study.cells}
    found = {
        name: (each.field, each.hold, each.assignment, tuple(each.risk_vectors))
        for name, each in rules.items()
    }
    assert found == {
        "thesis": ("table", "none", "hungarian", ("proportional",)),
        "table_held": ("table", "until_lost", "hungarian", ("proportional",)),
        "margin": ("margin", "none", "hungarian", ("proportional",)),
        "margin_held": ("margin", "until_lost", "hungarian", ("proportional",)),
        "lookahead_held": ("lookahead", "until_lost", "hungarian", ("proportional",)),
        "guarantee": ("guarantee", "certificate", "guarantee", ("proportional",)),
    }


def test_pursuers_may_be_chosen_and_are_compared_with_the_thesis_where_it_plays():
    options = {"runs": 1, "sizes": ("2v2",), "opponents": ("optimal",)}
    study = policies_study(pursuers=("certified", "thesis"), **options)
    certified = study.scenario(study.cells[0], 0).pursuers
    chosen = certified.field, certified.assignment, certified.switch
    assert chosen == ("certified", "guarantee", "certificate")
    assert policies_grid(study).pairs == (("2v2-certified-optimal", "2v2-thesis-optimal"),)
    assert policies_grid(policies_study(pursuers=("certified",), **options)).pairs == ()
    with pytest.raises(InvalidInput, match="`pursuers` must be one of thesis, table_held"):
        policies_study(pursuers=("nobody",), **options)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"opponents": ("nobody",)}, "`opponent` must be one of adversarial, best_response, rand"),
        # Nobody drives in a study, and nobody has waypoints.
        ({"opponents": ("you",)}, "`opponent` must be one of"),
        ({"opponents": ()}, "`opponent` must be one at least; got none"),
        ({"opponents": ("adversarial",) * 2}, "`opponent` must come once each; got adversarial tw"),
        (
            {"opponent_runs": {"random_walk": 2}},
            "`opponent-runs` must be one of adversarial, best_",
        ),
        ({"opponent_runs": {"adversarial": 0}}, "`opponent-runs` must be positive; got 0"),
    ],
)
def test_opponents_that_there_are_not_are_refused(options, complaint):
    with pytest.raises(InvalidInput, match=complaint):
        tracking_study(runs=1, **options)


@pytest.mark.parametrize("size", ["3", "0v1", "3v", "3x4", "3v4v5"])
def test_teams_that_there_are_not_are_refused(size):
    with pytest.raises(InvalidInput, match=f"`size` must have the form 3v4.*; got {size}"):
        policies_study(runs=1, sizes=(size,))


def test_runs_against_those_who_cost_most_are_fewer_unless_they_are_chosen():
    assert fewer_runs(OPPONENTS, 1000) == {"best_response": 100}
    assert fewer_runs(OPPONENTS, 30) == {"best_response": 30}
    assert fewer_runs(("adversarial",), 1000) == {}
    assert fewer_runs(OPPONENTS, 30, {"best_response": 200}) == {"best_response": 200}
    assert read_opponent_runs(["best_response=20", "adversarial=3"]) == {
        "best_response": 20,
        "adversarial": 3,
    }
    # The study has as many runs as the cell that has most.
    study = tracking_study(runs=3, sizes=(1,), opponent_runs={"best_response": 5})
    assert study.runs == 5
    assert runs_in_words(study) == "runs a cell: 3 against adversarial, 5 against best_response"
    alike = tracking_study(runs=3, sizes=(1,))
    assert runs_in_words(alike) == "3 runs a cell against adversarial and best_response"
    with pytest.raises(InvalidInput, match="`opponent-runs` must have the form best_response=100"):
        read_opponent_runs(["best_response:20"])


def test_t1_t2_and_t3_are_the_times_with_the_three_risk_vectors():
    titles = [panel.title for panel in tracking_grid(tracking_study(runs=1)).means]
    vectors = ("uniform", "majority", "proportional")
    expected = [
        f"t{k}: {vector} risk vector, against {opponent}"
        for opponent in OPPONENTS
        for k, vector in enumerate(vectors, start=1)
    ]
    assert titles == expected


def made_up(study, times_of):
    """A result in which the times are a function of cell and run, with a horizon of 120 s."""
    rows = [
        {
            "cell": cell.name,
            "run": run,
            "seed": run,
            "pursuers": int(cell.name[0]),
            "evaders": int(cell.name[2]),
            "horizon": 120.0,
            "time": min(times_of(cell.name, run), 120.0),
            "censored": times_of(cell.name, run) >= 120.0,
            "lost_evader": -1,
        }
        for cell in study.cells
        for run in range(study.runs_of(cell))
    ]
    return StudyResult(study, pa.Table.from_pylist(rows, schema=SCHEMA))


def test_a_strategy_that_is_better_in_every_run_is_found_to_be_so():
    study = assignment_study(runs=12, sizes=(2, 3))
    spread = np.random.default_rng(0).uniform(20.0, 80.0, 12)
    gains = {"borda_min": 10.0, "borda_max": 0.0, "random_visible": 0.0, "own_riskiest": -10.0}
    wobble = np.random.default_rng(1).normal(0.0, 1.0, (12, 16))
    names = [cell.name for cell in study.cells]
    result = made_up(
        study,
        lambda cell, run: (
            spread[run] + gains[match_of(cell).variant] + wobble[run, names.index(cell)]
        ),
    )
    grid = assignment_grid(study)
    found = {
        (each["first"], each["second"]): each
        for each in summarise_study(result, grid)["comparisons"]
    }
    assert len(found) == 16
    against = "adversarial"
    better = found[f"3v2-borda_min-{against}", f"3v2-own_riskiest-{against}"]
    assert better["opponent"] == against
    assert better["low"] < 20.0 < better["high"]
    assert better["holm_p"] < 1e-6
    same = found[f"3v2-borda_max-{against}", f"3v2-random_visible-{against}"]
    assert same["holm_p"] > 0.05


def test_the_worst_opponent_is_found_on_the_runs_that_all_have():
    """Though the mean over all runs is longer against the one that has only the first."""
    options = {"sizes": (2, 3), "vectors": ("uniform",)}
    study = tracking_study(runs=4, opponent_runs={"best_response": 2}, **options)

    def times_of(cell, run):
        n, _, _, opponent = match_of(cell)
        if opponent == "best_response":
            return 40.0 if n == 2 else 60.0
        return 50.0 if run < 2 else 10.0

    summary = summarise_study(made_up(study, times_of), tracking_grid(study))
    assert summary["runs"] == {"adversarial": 4, "best_response": 2}
    row = summary["matrix"]["2v3"]["uniform"]
    assert {name: each["mean"] for name, each in row.items()} == {
        "adversarial": 30.0,
        "best_response": 40.0,
    }
    assert all(each["low"] <= each["mean"] <= each["high"] for each in row.values())
    assert summary["worst"]["2v3"]["uniform"] == "best_response"
    assert summary["worst"]["3v3"]["uniform"] == "adversarial"
    tied = summarise_study(made_up(study, lambda cell, run: 60.0), tracking_grid(study))
    assert tied["worst"]["2v3"]["uniform"] == "undecided"
    assert summary["cells"]["3v3-uniform-best_response"]["opponent"] == "best_response"


def test_the_matrix_shows_every_mean_and_frames_the_worst():
    study = policies_study(runs=5, sizes=("1v1", "3v4"))
    worst = {"adversarial": 30.0, "best_response": 20.0, "random_walk": 90.0}
    worst |= {"optimal": 40.0, "optimal_distance": 35.0}
    result = made_up(study, lambda cell, run: worst[match_of(cell).opponent] + run)
    figure = draw_matrix(result, policies_grid(study))
    assert [axis.get_title() for axis in figure.axes] == ["1v1", "3v4"]
    for axis in figure.axes:
        assert [label.get_text() for label in axis.get_xticklabels()] == list(worst)
        said = [text.get_text().split("\n")[0] for text in axis.texts]
        assert said == ["32.0", "22.0", "92.0", "42.0", "37.0"] * 6
        framed = [(round(each.get_x()), round(each.get_y())) for each in axis.patches]
        assert framed == [(1, row) for row in range(6)]
    rows = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert rows == ["thesis", "table_held", "margin", "margin_held", "lookahead_held", "guarantee"]


def test_pictures_show_what_is_there():
    study = tracking_study(runs=5, sizes=(1, 2))
    result = made_up(study, lambda cell, run: 30.0 * (run + 1))
    grid = tracking_grid(study)
    means, curves = draw_means(result, grid), draw_curves(result, grid)
    # Three vectors side by side, an opponent below the other.
    assert means.axes[3].get_subplotspec().colspan.start == 0
    assert [axis.get_title() for axis in means.axes] == [panel.title for panel in grid.means]
    for axis in means.axes:
        for container in axis.containers:
            # 30, 60, 90, 120 and 150 s, the last one cut off.
            np.testing.assert_allclose(container.lines[0].get_ydata(), 84.0)
    for axis in curves.axes:
        for line in axis.get_lines():
            assert line.get_ydata()[0] == 1.0
            assert line.get_ydata()[-1] == pytest.approx(0.4)
            assert line.get_xdata()[-1] == 120.0


def test_tables_hold_the_means_of_panels_or_of_the_matrix():
    team = tracking_study(runs=3, sizes=(1, 2), vectors=("uniform",), opponents=("adversarial",))
    grid = tracking_grid(team)
    result = made_up(team, lambda cell, run: 10.0 * match_of(cell).evaders)
    (table,) = mean_tables(summarise_study(result, grid), grid)
    assert table.title.startswith("t1: uniform risk vector, against adversarial: mean up to")
    assert table.head == ("evaders", "1", "2")
    row = ("10.0 (10.0-10.0)", "20.0 (20.0-20.0)")
    assert table.rows == (("1 pursuer", *row), ("2 pursuers", *row))
    sizes = policies_study(runs=3, sizes=("3v4",), opponents=OPPONENTS)
    grid = policies_grid(sizes)
    result = made_up(sizes, lambda cell, run: 5.0 if "best" in cell else 30.0)
    tables = mean_tables(summarise_study(result, grid), grid)
    (table,) = tables
    assert table.head == ("pursuers", *OPPONENTS)
    assert table.rows[0] == ("thesis", "30.0 (30.0-30.0)  ", "5.0 (5.0-5.0) *")
    assert to_markdown(tables).splitlines()[2:5] == [
        "| pursuers | adversarial | best_response |",
        "| --- | --- | --- |",
        "| thesis | 30.0 (30.0-30.0) | 5.0 (5.0-5.0) * |",
    ]


def test_where_several_are_the_worst_none_is_framed():
    study = policies_study(runs=3, sizes=("1v1",))
    result = made_up(study, lambda cell, run: 60.0)
    (axis,) = draw_matrix(result, policies_grid(study)).axes
    assert len(axis.patches) == 0

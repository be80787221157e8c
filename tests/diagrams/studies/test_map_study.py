"""What the map decides, against worlds where the answer is known and pairs counted one by one."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.studies.map_study import MapStudy, draw_maps, mean_share, run_map_study
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.run_seeds import run_seed
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

COARSE = {"grid": 0.25, "seed": 3, "arenas": 3}


def study_map(*words):
    """Run the command in this process."""
    done = CliRunner().invoke(make_app(), ["study", "map", *map(str, words)])
    if isinstance(done.exception, InvalidInput):
        raise done.exception
    assert done.exit_code == 0
    return done


def test_in_an_empty_arena_everything_is_seen_and_kept():
    found = run_map_study(
        MapStudy(values={"obstacles": (0.0,), "speed_ratio": (0.9,)}, arena=Arena(obstacles=0)),
        workers=0,
    )
    for factor, value in (("obstacles", 0.0), ("speed_ratio", 0.9)):
        np.testing.assert_array_equal(found.kept(factor, value), 1.0)
        np.testing.assert_array_equal(found.sighted(factor, value), 1.0)


def test_shares_are_those_of_pairs_counted_one_by_one():
    values = {"obstacles": (2.0, 4.0)}
    result = run_map_study(MapStudy(values=values, speed_ratio=0.4, **COARSE), workers=0)
    for value in values["obstacles"]:
        for k in range(COARSE["arenas"]):
            world = draw_arena(Arena(obstacles=int(value)), run_seed(COARSE["seed"], k))
            table = solve_visibility_game(
                world, pursuer_speed=2.0, evader_speed=0.8, grid=COARSE["grid"]
            )
            times = np.stack([table.times_from(place) for place in table.places])
            # Kept for the shortest time, for ever, and all places where evaders can be.
            seen, ever, all_pairs = times > 0.0, np.isinf(times), ~np.isnan(times)
            kept = ever.sum() / table.pairs
            assert result.kept("obstacles", value)[k] == pytest.approx(kept)
            assert result.sighted("obstacles", value)[k] >= seen.sum() / all_pairs.sum()
            assert result.sighted("obstacles", value)[k] == pytest.approx(
                table.pairs / all_pairs.sum()
            )
            assert 0.2 < kept < 1.0


def test_faster_evaders_are_kept_less_in_each_arena():
    values = {"speed_ratio": (0.2, 0.4, 0.8)}
    result = run_map_study(MapStudy(values=values, **COARSE), workers=0)
    kept = np.array([result.kept("speed_ratio", value) for value in values["speed_ratio"]])
    assert (np.diff(kept, axis=0) < -0.02).all()


def test_settings_change_what_they_say_and_nothing_else():
    study = MapStudy(arena=Arena(obstacles=4, shortest=0.2, longest=0.6, gap=0.35))
    assert study.setting("speed_ratio", 0.5) == (study.arena, 0.5)
    assert study.setting("gap", 0.2) == (
        Arena(obstacles=4, shortest=0.2, longest=0.6, gap=0.2),
        0.3,
    )
    larger, _ = study.setting("size", 0.8)
    assert (larger.shortest, larger.longest) == pytest.approx((0.4, 1.2))
    pieces, _ = study.setting("pieces", 16.0)
    # Four times as many, half as long.
    assert (pieces.obstacles, pieces.shortest, pieces.longest) == pytest.approx((16, 0.1, 0.3))
    assert study.setting("obstacles", 7.0)[0] == Arena(
        obstacles=7, shortest=0.2, longest=0.6, gap=0.35
    )


def test_means_have_students_interval_within_what_shares_can_be():
    found = mean_share(np.array([0.5, 0.7, 0.9]))
    # Standard error 0.2 / sqrt(3), and 4.303 of them.
    assert (found.value, found.low, found.high) == pytest.approx((0.7, 0.2032, 1.0), abs=1e-4)
    assert mean_share(np.array([0.5])).low == 0.5


def test_the_command_leaves_its_table_numbers_and_picture(tmp_path):
    words = ("--factor", "obstacles", "--factor", "speed_ratio", "--arenas", 2, "--grid", 0.28)
    done = study_map(*words, "--workers", 1, "--json", "--out", tmp_path / "out")
    summary = json.loads(done.stdout)
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == summary
    left = {file.name for file in (tmp_path / "out").glob("[!.]*")}
    assert left == {"table.parquet", "summary.json", "tables.md", "map.png"}
    rows = pq.read_table(tmp_path / "out" / "table.parquet").to_pylist()
    assert len(rows) == 2 * (7 + 6)
    for factor, entries in summary["factors"].items():
        for each in entries:
            some = [r for r in rows if (r["factor"], r["value"]) == (factor, each["value"])]
            assert each["kept"] == pytest.approx(np.mean([r["kept"] for r in some]))
            assert each["low"] <= each["kept"] <= each["high"]
    text = (tmp_path / "out" / "tables.md").read_text()
    assert "| number of obstacles | of the pairs in sight, kept for ever, 95% interval |" in text


def test_in_a_world_of_ones_own_the_ratio_alone_is_varied(tmp_path):
    file = tmp_path / "room.wkt"
    file.write_text(
        "POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0), (1.5 1.4, 2.6 1.4, 2.6 2.7, 1.5 2.7, 1.5 1.4))"
    )
    done = study_map("--world", file, "--grid", 0.25, "--workers", 0, "--json")
    summary = json.loads(done.stdout)
    assert list(summary["factors"]) == ["speed_ratio"]
    kept = [each["kept"] for each in summary["factors"]["speed_ratio"]]
    assert sorted(kept, reverse=True) == kept
    assert kept[0] > kept[-1] + 0.2
    assert summary["arenas"] == 1


def test_the_picture_has_a_panel_for_each_factor_and_a_dot_for_each_arena():
    values = {"obstacles": (1.0, 2.0), "gap": (0.3, 0.4)}
    study = MapStudy(values=values, grid=0.28, arenas=2)
    figure = draw_maps(run_map_study(study, workers=0))
    shown = [axis for axis in figure.axes if axis.axison]
    assert [axis.get_xlabel() for axis in shown] == [
        "number of obstacles",
        "least gap between obstacles [m]",
    ]
    for axis in shown:
        dots = [line for line in axis.get_lines() if line.get_marker() == "o"]
        # Two values of two arenas, and their means.
        assert sorted(len(line.get_xdata()) for line in dots) == [2, 2, 2]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--arenas", 1), "`arenas` must be two at least; got 1"),
        (("--speed-ratio", 1.0), "`speed_ratio` must lie strictly between 0 and 1; got 1.0"),
        (("--grid", 0.2), "`grid` must be below the least gap between obstacles, 0.15 m; got 0.2"),
        (("--bound", "best"), "`bound` must be one of lower, middle, upper; got best"),
        (("--factor", "colour"), "`factor` must be one of obstacles, pieces, size, gap, speed_ra"),
        (("--set", "pace=3"), "`--set` must be one of arena.side, "),
        (("--world", "a.wkt", "--set", "arena.gap=1"), "`--set` must not set the arena with --wo"),
        (("--workers", -1), "`workers` must be zero or positive; got -1"),
        (("--seed", -1), "`seed` must be zero or positive; got -1"),
    ],
)
def test_nonsense_is_refused_in_one_line(words, complaint):
    with pytest.raises(InvalidInput) as caught:
        study_map(*words)
    assert str(caught.value).startswith(complaint)
    assert "\n" not in str(caught.value)

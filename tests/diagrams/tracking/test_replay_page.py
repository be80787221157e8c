"""`replay.html`, in headless Chromium without a network, plays the game as it was."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.visuals.replay import write_replay

pytestmark = pytest.mark.browser

END = 3.5
# The start, before and after each change of who sees whom, within a step, the end.
TIMES = [0.0, 0.95, 1.0, 1.73, 2.45, 2.5, END]
# Who sees whom changes at keys of the recording, once in a step.
STEP = 0.05


@pytest.fixture(scope="module")
def replay(meshcat, make_game, tmp_path_factory):
    """The known game, its replay's file, and the page on which it plays."""
    game = make_game(meshcat, recording=True)
    Simulator(game.diagram).AdvanceTo(END)
    return game, write_replay(game.scene, tmp_path_factory.mktemp("run") / "replay.html")


@pytest.fixture(scope="module")
def page(replay, new_scene_page):
    """The page, all of whose network is cut."""
    _, path = replay
    return new_scene_page(path.as_uri(), offline=True)


@pytest.fixture(scope="module")
def game(replay):
    return replay[0]


def step_before(time: float) -> float:
    return np.floor(time / STEP + 1e-9) * STEP


def test_robots_are_where_the_game_had_them(page, game):
    for time in TIMES:
        page.seek(time)
        for team in ("pursuers", "evaders"):
            expected = game.positions(team, time)
            drawn = [page.position(f"{team}/{k}") for k in range(len(expected))]
            np.testing.assert_allclose(drawn, expected, atol=1e-3)


def test_robots_keep_looking_where_they_went(page):
    for time in (1.0, 3.0):
        page.seek(time)
        assert page.heading("pursuers/0/body") == pytest.approx(np.pi / 2, abs=1e-6)


def line(page, path: str) -> np.ndarray:
    """The ends of a line of sight or a chase, shape (4,): x, y, x, y."""
    end = page.matrix(f"{path}/bar") @ [1.0, 0.0, 0.0, 1.0]
    return np.hstack([page.position(path), end[:2]])


def test_lines_join_those_who_saw_and_chased_each_other(page, game):
    for time in TIMES:
        page.seek(time)
        pursuers, evaders = (game.positions(team, time) for team in ("pursuers", "evaders"))
        sight = {f"{i}_{j}": (i, j) for i, j in np.argwhere(game.visibility(time))}
        chases = {f"{i}_{j}": (i, j) for i, j in enumerate(game.assignment(time)) if j >= 0}
        for kind, lines in (("sight", sight), ("chases", chases)):
            assert page.shown_below(kind) == set(lines), (kind, time)
            for name, (i, j) in lines.items():
                expected = np.hstack([pursuers[i], evaders[j]])
                np.testing.assert_allclose(line(page, f"{kind}/{name}"), expected, atol=2e-3)


def test_a_chase_does_not_sweep_from_one_evader_to_the_next(page, game):
    page.seek(2.5 - 0.4 * STEP)
    assert page.shown_below("chases") == {"0_0"}
    end = line(page, "chases/0_0")[2:]
    np.testing.assert_allclose(end, game.positions("evaders", 2.5)[0], atol=2e-3)


def test_the_graph_has_the_edges_of_sight_and_chase(page, game):
    for time in TIMES:
        page.seek(time)
        sight = {f"{i}_{j}" for i, j in np.argwhere(game.visibility(time))}
        chases = {f"{i}_{j}" for i, j in enumerate(game.assignment(time)) if j >= 0}
        assert page.shown_below("graph/sight") == sight
        assert page.shown_below("graph/chases") == chases


def test_the_clock_and_the_state_are_those_of_the_time(page, game):
    for time in TIMES:
        page.seek(time)
        in_sight = game.visibility(time).any(axis=0)
        assert page.number("clock/digits") == int(step_before(time) * 10 + 1e-6)
        assert page.number("in_sight/digits") == in_sight.sum()
        assert page.shown("state/in_sight") == in_sight.all()
        assert page.shown("state/lost") != in_sight.all()
        assert [page.shown(f"evaders/{k}/ghost") for k in range(3)] == (~in_sight).tolist()


def test_one_visible_area_is_shown_and_it_is_a_recent_one(page, game):
    for time in TIMES:
        page.seek(time)
        (shown,) = page.shown_below("polygon")
        apex = page.vertices(f"polygon/{shown}")[-1, :2]
        # 0.75 m/s at most, redrawn every 0.2 s.
        assert np.hypot(*(apex - game.positions("pursuers", time)[0])) <= 1.25 * 0.2 + 1e-6


def test_one_field_is_shown_while_the_chosen_pursuer_chases(page, game):
    for time in TIMES:
        page.seek(time)
        assert len(page.shown_below("field")) == int(game.assignment(time)[0] >= 0)


def test_trails_grow_with_the_time(page):
    counts = []
    for time in TIMES:
        page.seek(time)
        counts.append(len(page.shown_below("trails/evaders")))
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, 7)


def test_playing_goes_on_after_the_slider_was_moved_back(page, game):
    """Meshcat pauses each path at its own last key, so all must have theirs at the end."""
    page.page.evaluate(
        """() => {
            viewer.animator.reset();
            viewer.animator.play();
            viewer.animator.mixer.update(3.0);
            viewer.animator.seek(0.5);
            viewer.animator.mixer.update(1.01);
            viewer.animator.pause();
        }"""
    )
    assert page.number("clock/digits") == 15
    assert page.shown("state/lost")
    assert page.shown_below("graph/sight") == {"0_0", "1_1"}
    np.testing.assert_allclose(
        page.position("pursuers/0"), game.positions("pursuers", 1.51)[0], atol=1e-3
    )


def test_the_page_has_a_title_and_no_errors_and_asks_for_nothing(page, replay):
    assert "Sightfield" in page.page.title()
    assert page.watched.complaints == []
    assert page.watched.requests == [replay[1].as_uri()]


def test_a_second_run_is_recorded_anew(meshcat, make_game, new_scene_page, tmp_path):
    game = make_game(meshcat, recording=True)
    simulator = Simulator(game.diagram)
    simulator.AdvanceTo(2.0)
    simulator.get_mutable_context().SetTime(0.0)
    simulator.Initialize()
    simulator.AdvanceTo(1.0)
    path = write_replay(game.scene, tmp_path / "replay.html")
    page = new_scene_page(path.as_uri(), offline=True)
    page.seek(3.0)
    assert page.number("clock/digits") == 10
    assert page.shown_below("sight") == {"0_0", "1_1"}

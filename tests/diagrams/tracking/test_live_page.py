"""The live page, in headless Chromium, shows the game as it is."""

import cv2
import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.tracking.scene import View

pytestmark = pytest.mark.browser

# Before a change of who sees whom, and after one.
TIMES = [0.0, 0.65, 1.35, 3.2]


class LiveGame:
    """The known game, and the page on which it goes on."""

    def __init__(self, game, page) -> None:
        self.game = game
        self.page = page
        self.simulator = Simulator(game.diagram)

    def play_to(self, time: float) -> None:
        self.simulator.AdvanceTo(time)
        self.page.settle(self.game.meshcat)


@pytest.fixture(scope="module")
def page(meshcat, new_scene_page):
    """The page that all tests look at; each game clears it."""
    return new_scene_page(meshcat.web_url())


@pytest.fixture
def live(meshcat, page, make_game) -> LiveGame:
    return LiveGame(make_game(meshcat, recording=False), page)


def bars(vertices: np.ndarray) -> np.ndarray:
    """Ends of the bars that a mesh is made of, shape (k, 4): x, y, x, y."""
    corners = vertices.reshape(-1, 4, 3)[:, :, :2]
    return np.hstack([corners[:, [0, 3]].mean(axis=1), corners[:, [1, 2]].mean(axis=1)])


def test_robots_are_where_the_game_has_them(live):
    for time in TIMES:
        live.play_to(time)
        for team in ("pursuers", "evaders"):
            expected = live.game.positions(team, time)
            drawn = [live.page.position(f"{team}/{k}") for k in range(len(expected))]
            np.testing.assert_allclose(drawn, expected, atol=1e-5)


def test_robots_look_where_they_go_and_keep_looking_there_when_they_stop(live):
    for time in (1.0, 3.0):
        live.play_to(time)
        assert live.page.heading("pursuers/0/body") == pytest.approx(np.pi / 2)
    step = live.game.positions("evaders", 3.0) - live.game.positions("evaders", 2.9)
    assert live.page.heading("evaders/1/body") == pytest.approx(np.arctan2(step[1, 1], step[1, 0]))


def test_lines_join_those_who_see_and_chase_each_other(live):
    for time in TIMES:
        live.play_to(time)
        pursuers, evaders = (live.game.positions(team, time) for team in ("pursuers", "evaders"))
        i, j = np.nonzero(live.game.visibility(time))
        expected = np.hstack([pursuers[i], evaders[j]])
        np.testing.assert_allclose(bars(live.page.vertices("sight")), expected, atol=1e-5)

        target = live.game.assignment(time)
        expected = np.hstack([pursuers, evaders[target]])[target >= 0]
        np.testing.assert_allclose(bars(live.page.vertices("chases")), expected, atol=1e-5)


def test_the_graph_has_the_edges_of_sight_and_chase(live):
    for time in TIMES:
        live.play_to(time)
        sight = {f"{i}_{j}" for i, j in np.argwhere(live.game.visibility(time))}
        chases = {f"{i}_{j}" for i, j in enumerate(live.game.assignment(time)) if j >= 0}
        assert live.page.shown_below("graph/sight") == sight
        assert live.page.shown_below("graph/chases") == chases


def test_an_edge_of_the_graph_joins_its_nodes(live):
    live.play_to(0.0)
    for i, j in ((0, 0), (1, 2)):
        (edge,) = bars(live.page.vertices(f"graph/sight/{i}_{j}"))
        nodes = [f"graph/nodes/pursuers/{i}", f"graph/nodes/evaders/{j}"]
        np.testing.assert_allclose(
            edge, np.hstack([live.page.position(node) for node in nodes]), atol=1e-5
        )


def test_the_clock_shows_the_time_to_the_tenth(live):
    for time, tenths in ((0.0, 0), (1.35, 13), (3.2, 32)):
        live.play_to(time)
        assert live.page.number("clock/digits") == tenths


def test_the_panel_and_the_map_say_who_is_out_of_sight(live):
    live.play_to(0.5)
    assert live.page.shown("state/in_sight")
    assert not live.page.shown("state/lost")
    assert live.page.number("in_sight/digits") == 3
    assert not live.page.shown("evaders/2/ghost")

    live.play_to(1.5)
    assert live.page.shown("state/lost")
    assert not live.page.shown("state/in_sight")
    assert live.page.number("in_sight/digits") == 2
    for folder in ("evaders/{}/ghost", "graph/ghosts/{}"):
        assert [live.page.shown(folder.format(k)) for k in range(3)] == [False, False, True]


def test_the_visible_area_is_that_of_the_chosen_pursuer(live):
    for time in TIMES:
        live.play_to(time)
        pursuer = live.game.positions("pursuers", time)[0]
        *ring, apex = live.page.vertices("polygon/0")[:, :2]
        np.testing.assert_allclose(apex, pursuer, atol=1e-5)
        half_width = np.abs(np.array(ring) - pursuer)
        np.testing.assert_allclose(half_width, np.full((4, 2), 0.3), atol=1e-5)


def test_the_arrows_follow_the_field_around_the_chosen_pursuer(live):
    live.play_to(0.5)
    tip, left, waist, right = live.page.vertices("field/0")[:, :2].reshape(-1, 4, 2).swapaxes(0, 1)
    assert len(tip) > 10
    np.testing.assert_allclose(tip[:, 1], waist[:, 1], atol=1e-6)
    assert (tip[:, 0] > waist[:, 0]).all()
    assert (waist[:, 0] > left[:, 0]).all()
    np.testing.assert_allclose(left[:, 0], right[:, 0], atol=1e-6)
    away = 0.5 * (tip + 0.5 * (left + right)) - live.game.positions("pursuers", 0.5)[0]
    assert np.hypot(*away.T).max() < 1.0


def test_a_trail_lies_where_the_robot_was(live):
    live.play_to(1.6)
    drawn = np.vstack([live.page.vertices(f"trails/pursuers/{k}") for k in (1, 2, 3)])
    np.testing.assert_allclose(drawn[:, 0], 0.5, atol=0.02)
    assert drawn[:, 1].min() == pytest.approx(0.5)
    assert drawn[:, 1].max() == pytest.approx(live.game.positions("pursuers", 1.5)[0, 1])


def test_another_view_shows_another_pursuer_or_nobody(meshcat, page, make_game):
    views = [View(chosen_pursuer=1), View(chosen_pursuer=-1), View(field_shown=False)]
    game = make_game(meshcat, recording=False, view=lambda: views[0])
    live = LiveGame(game, page)

    live.play_to(0.5)
    assert [page.shown(f"pursuers/{k}/chosen") for k in (0, 1)] == [False, True]
    np.testing.assert_allclose(
        page.vertices("polygon/0")[-1, :2], game.positions("pursuers", 0.5)[1], atol=1e-5
    )
    views.pop(0)
    live.play_to(0.7)
    assert not any(page.shown(f"pursuers/{k}/chosen") for k in (0, 1))
    assert not page.shown("polygon/0")
    assert not page.shown("field/0")
    views.pop(0)
    live.play_to(1.2)
    assert page.shown("polygon/0")
    assert not page.shown("field/0")


def test_a_second_run_starts_from_a_clean_sheet(live):
    live.play_to(2.6)
    assert live.page.shown_below("trails/pursuers")
    live.simulator.get_mutable_context().SetTime(0.0)
    live.simulator.Initialize()
    live.page.settle(live.game.meshcat)
    assert live.page.shown_below("trails/pursuers") == set()
    assert live.page.number("clock/digits") == 0
    np.testing.assert_allclose(
        live.page.position("pursuers/0"), live.game.positions("pursuers", 0.0)[0], atol=1e-6
    )


def test_map_and_panel_are_in_view_beside_each_other(live):
    live.play_to(0.0)
    sheet = live.page.watched.on_screen(live.page.vertices("panel/sheet")[:, :2])
    wall = live.page.watched.on_screen(live.page.vertices("world/wall")[:, :2])
    pixels = np.vstack([sheet, wall])
    assert (pixels >= 0).all()
    # Meshcat's controls, unfolded, take the last 245 pixels.
    assert (pixels <= [1280 - 245, 720]).all()
    assert sheet[:, 0].max() < wall[:, 0].min()
    assert np.ptp(wall[:, 0]) > 500


def test_colours_come_out_as_the_palette_has_them(live):
    live.play_to(0.0)
    # The middle of the block, a free spot, the middle of the grown boundary's south side.
    places = live.page.watched.on_screen(np.array([[2.0, 1.4], [3.0, 2.8], [3.7, 0.12]]))
    image = cv2.imdecode(np.frombuffer(live.page.page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    shown = [image[round(y), round(x), ::-1] / 255 for x, y in places]
    wanted = [(0.30, 0.66, 0.37), (0.985, 0.985, 0.985), (0.95, 0.55, 0.13)]
    np.testing.assert_allclose(shown, wanted, atol=0.02)


def test_the_page_has_nothing_to_complain_of_and_asks_nobody_else(live):
    live.play_to(3.0)
    assert live.page.watched.complaints == []
    own = live.game.meshcat.web_url()
    assert live.page.watched.requests
    assert [url for url in live.page.watched.requests if not url.startswith(own)] == []

"""The live page and the replay of a real run show what its log says."""

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.diagrams.visuals.replay import write_replay

pytestmark = pytest.mark.browser


def load(*settings):
    """The thesis's arena."""
    return load_scenario(TrackingScenario, find_scenario("thesis_3v4"), settings)


@pytest.fixture(scope="module")
def game():
    """A game in which an evader is lost after two seconds."""
    return set_up_game(with_random_starts(load("seed=9")))


def check_robots(page, run, sample):
    """Assert that the page has every robot where the log has it."""
    for team in ("pursuer", "evader"):
        expected = run.log[f"{team}_position"][sample]
        drawn = [page.position(f"{team}s/{k}") for k in range(len(expected))]
        np.testing.assert_allclose(drawn, expected, atol=1e-3)


def test_the_replay_is_the_log(game, meshcat, new_scene_page, tmp_path):
    run = run_tracking(game, meshcat, recording=True)
    path = write_replay(run.scene, tmp_path / "replay.html")
    page = new_scene_page(path.as_uri(), offline=True)
    last = len(run.times) - 1
    for sample in np.unique(np.linspace(0, last, 12).astype(int)):
        page.seek(run.times[sample])
        check_robots(page, run, sample)
        sight = {f"{i}_{j}" for i, j in np.argwhere(run.log["visibility"][sample])}
        assert page.shown_below("sight") == sight
    assert page.shown("state/lost")
    assert page.shown(f"evaders/{run.lost_evader}/ghost")
    assert page.watched.complaints == []


def test_the_live_page_ends_where_the_log_ends(game, new_scene_page):
    meshcat = open_live_page(port=0)
    page = new_scene_page(meshcat.web_url())
    run = run_tracking(game, meshcat)
    page.settle(meshcat)
    check_robots(page, run, -1)
    assert page.shown("state/lost")


def test_stop_on_the_page_ends_the_run(new_scene_page):
    meshcat = open_live_page(port=0)
    page = new_scene_page(meshcat.web_url())

    def press_stop(seconds):
        if seconds >= 1.0:
            page.page.keyboard.press("Escape")
            page.page.wait_for_timeout(50)

    run = run_tracking(set_up_game(load()), meshcat, live=True, progress=press_stop)
    assert run.lost_evader is None
    assert 1.0 <= run.tracking_time < 5.0
    assert run.times[-1] == pytest.approx(run.tracking_time)

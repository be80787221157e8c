"""`replay.html` of a search, in headless Chromium without a network, plays it as it was."""

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from sightfield.diagrams.social.report import summarise_search, write_search_report

pytestmark = pytest.mark.browser

# Friends of the first agent and the last; the second one never answers.
SETTINGS = ("agents.friending=[1, 0, 1]", "agents.rejection=[0, 0, 0]", "seconds=3")


@pytest.fixture(scope="module")
def replay(search, tmp_path_factory):
    """A search and the folder of its report."""
    page = Meshcat(MeshcatParams(port=0, show_stats_plot=False))
    run = search(*SETTINGS, standing=True, meshcat=page, recording=True)
    folder = tmp_path_factory.mktemp("search")
    written = write_search_report(run, summarise_search(run, "standing"), folder)
    assert sorted(written) == sorted(each.name for each in folder.iterdir())
    return run, folder / "replay.html"


@pytest.fixture(scope="module")
def watched(replay, new_page):
    watched = new_page()
    watched.open_replay(replay[1])
    return watched


def shown(watched, path):
    return watched.page.evaluate("path => shown(path)", f"social/{path}")


def position(watched, path):
    code = "path => { const p = node(path).object.position; return [p.x, p.y]; }"
    return np.array(watched.page.evaluate(code, f"social/{path}"))


def test_robots_are_where_the_search_had_them(replay, watched):
    run, _ = replay
    for time in (0.0, 1.5, 3.0):
        watched.seek(time)
        for robot, (x, y, _) in enumerate(run.log["pose"][round(time / 0.05)]):
            np.testing.assert_allclose(position(watched, f"robots/{robot}"), [x, y], atol=2e-3)


def test_the_graph_shows_friends_and_who_was_asked(watched):
    watched.seek(2.5)
    for agent, state in ((0, "friend"), (1, "waiting"), (2, "friend")):
        for each in ("friend", "waiting", "stranger"):
            assert shown(watched, f"friends/{agent}/{each}") == (each == state), (agent, each)


def test_the_estimate_and_the_banner_show_once_the_evader_is_located(replay, watched):
    run, _ = replay
    watched.seek(0.0)
    assert shown(watched, "state/unknown")
    assert not shown(watched, "estimate")
    watched.seek(2.9)
    assert shown(watched, "state/located")
    assert not shown(watched, "state/unknown")
    assert shown(watched, "estimate")
    np.testing.assert_allclose(position(watched, "estimate/at"), [1.1, 1.1], atol=0.02)
    assert len(run.located) == 2


def test_pictures_follow_one_another_and_say_whether_they_were_read(watched):
    # Taken at 0 s and 2 s; those of friends are shown again with their matches.
    for time, friend, stranger in ((0.6, 1, 0), (2.6, 3, 1)):
        watched.seek(time)
        for agent, number in ((0, friend), (1, stranger), (2, friend)):
            for k in range(4):
                assert shown(watched, f"pictures/{agent}/{k}") == (k == number), (time, agent, k)
            assert shown(watched, f"titles/{agent}/read") == (agent != 1)
            assert shown(watched, f"titles/{agent}/unread") == (agent == 1)


def test_the_page_is_whole_and_asks_for_nothing(watched):
    assert watched.complaints == []
    outside = [
        each for each in watched.requests if not each.startswith(("file:", "data:", "blob:"))
    ]
    assert outside == []

"""`replay.html` of a harvest, in headless Chromium without a network, plays it as it was."""

import math

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.crop_layer import crop_patches
from sightfield.diagrams.harvest.harvest_scene import SPEED_UP
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.machine_shapes import tank_box
from sightfield.diagrams.harvest.report import summarise_harvest, write_harvest_report
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.systems.numerics.planning.trailer import trailer_pose

pytestmark = pytest.mark.browser

SETTINGS = [
    "field.width=120",
    "field.height=90",
    "combines.header_width=9",
    "combines.turning_radius=6",
    "combines.capacity=1500",
    "hours=0.15",
]

# Samples of the log [s], and whenever somebody has been pouring for a sample and goes on.
MOMENTS = [0.0, 100.0, "pouring", 530.0]


@pytest.fixture(scope="module")
def replay(tmp_path_factory):
    """A short harvest of a small field and the folder of its report."""
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), SETTINGS)
    page = Meshcat(MeshcatParams(port=0, show_stats_plot=False))
    run = run_harvest(prepare_harvest(scenario), page, recording=True)
    folder = tmp_path_factory.mktemp("harvest")
    written = write_harvest_report(run, summarise_harvest(run, "small"), folder)
    kept = [each for each in folder.rglob("*") if each.is_file()]
    assert sorted(written) == sorted(str(each.relative_to(folder)) for each in kept)
    return run, folder / "replay.html"


@pytest.fixture(scope="module")
def watched(replay, new_page):
    watched = new_page()
    watched.open_replay(replay[1])
    return watched


@pytest.fixture(params=MOMENTS)
def moment(request, replay, watched):
    """A sample of the log at a time [s] to which the replay has been wound."""
    run, _ = replay
    if request.param == "pouring":
        pours = (run.log["alongside"] >= 0).any(axis=1)
        lasting = np.flatnonzero(pours[:-2] & pours[1:-1] & pours[2:])
        assert len(lasting) > 0
        time = float(run.times[lasting[0] + 1])
    else:
        time = request.param
    code = "time => { viewer.animator.pause(); viewer.animator.seek(time + 1e-5); }"
    watched.page.evaluate(code, time / SPEED_UP)
    k = int(np.argmin(np.abs(run.times - time)))
    assert run.times[k] == time
    return {name: each[k] for name, each in run.log.items()} | {"time": time}


def shown(watched, path):
    return watched.page.evaluate("path => shown(path)", f"harvest/{path}")


def vector(watched, path, kind):
    code = "([path, kind]) => { const p = node(path).object[kind]; return [p.x, p.y]; }"
    return np.array(watched.page.evaluate(code, [f"harvest/{path}", kind]))


def number(watched, path, places, decimals):
    """What the digits at a path show."""
    value = 0.0
    for place in range(places):
        digits = [d for d in range(10) if shown(watched, f"{path}/{place}/{d}")]
        assert len(digits) <= 1
        value += sum(digits) * 10.0 ** (place - decimals)
    return value


def test_combines_are_where_they_were(watched, moment):
    for n, (x, y, _) in enumerate(moment["pose"]):
        np.testing.assert_allclose(vector(watched, f"combines/{n}", "position"), [x, y], atol=0.3)


def test_carts_are_where_they_were(replay, watched, moment):
    job = replay[0].job
    for k, state in enumerate(moment["state"]):
        towed = trailer_pose(*state, job.scenario.carts.trailer)
        for body, pose in (("tractor", state), ("trailer", towed)):
            drawn = vector(watched, f"carts/{k}/{body}", "position")
            np.testing.assert_allclose(drawn, pose[:2], atol=0.3)


def test_tanks_and_clock_say_what_the_log_says(replay, watched, moment):
    job = replay[0].job
    rear, _, front, _ = tank_box(job.scenario.combines)
    assert number(watched, "numbers/time", 4, 1) == pytest.approx(moment["time"] / 60, abs=0.101)
    for n, tank in enumerate(moment["tank"]):
        assert number(watched, f"tanks/{n}/digits", 4, 1) == pytest.approx(
            math.floor(tank / 100 + 1e-6) / 10, abs=0.101
        )
        bar = vector(watched, f"combines/{n}/tank/fill/at/bar", "scale")[0]
        fill = tank / job.scenario.combines.capacity
        assert bar / (front - rear) == pytest.approx(fill, abs=0.02)


def test_crop_stands_where_no_combine_has_been(replay, watched, moment):
    job = replay[0].job
    patches, _ = crop_patches(job.field, job.scenario.combines, job.plan.service.plans)
    for k, patch in enumerate(patches):
        left = patch.end - moment["station"][patch.combine]
        if abs(left) > 1.0:
            assert shown(watched, f"crop/{k}/patch") == (left > 0), k
        if left > 1.0:
            length = vector(watched, f"crop/{k}/patch", "scale")[0]
            assert length == pytest.approx(min(left, patch.end - patch.begin), abs=0.5)


def test_an_auger_is_out_while_it_pours(watched, moment):
    for n, cart in enumerate(moment["alongside"]):
        assert shown(watched, f"combines/{n}/auger/out") == (cart >= 0)
        assert shown(watched, f"combines/{n}/auger/folded") == (cart < 0)


def test_of_each_cart_the_next_visit_is_marked_where_it_begins(replay, watched, moment):
    job = replay[0].job
    visits = job.plan.service.visits
    assert len(visits) >= 2
    count = job.scenario.combines.count
    for k in range(job.scenario.carts.count):
        clock = moment["time"] - moment["late"][count + k]
        mine = [v for v, visit in enumerate(visits) if visit.cart == k]
        coming = [v for v in mine if visits[v].end > clock][:1]
        assert [v for v in mine if shown(watched, f"visits/{v}")] == coming
        for v in coming:
            plan = job.plan.service.plans[visits[v].combine]
            place = vector(watched, f"visits/{v}", "position")
            off = place - plan.pose_at(visits[v].begin)[:2]
            assert np.hypot(*off) == pytest.approx(job.reach, abs=1e-6)


def test_the_page_is_whole_and_asks_for_nothing(watched):
    assert watched.complaints == []
    outside = [
        each for each in watched.requests if not each.startswith(("file:", "data:", "blob:"))
    ]
    assert outside == []

"""Harvests from the first metre to the last kilogram."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.driver_map import _draw_scale, draw_map
from sightfield.diagrams.harvest.fleet_size import find_what_it_takes
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.pictures import BAR, draw_timetable
from sightfield.diagrams.harvest.report import planned_tanks, summarise_harvest
from sightfield.diagrams.harvest.run import LOG_PERIOD, STILL, run_harvest
from sightfield.diagrams.harvest.scenario import FieldSource, HarvestScenario
from sightfield.diagrams.scenario_files import builtin_scenarios, find_scenario, load_scenario
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.harvest_log import read_harvest
from sightfield.systems.numerics.harvest.carts.visit_choice import EMPTY
from sightfield.systems.numerics.harvest.field.field_files import read_field
from sightfield.systems.numerics.harvest.plan.plan_files import swaths_of

SMALL = [
    "field.width=120",
    "field.height=90",
    "combines.header_width=9",
    "combines.turning_radius=6",
    "combines.capacity=3000",
]


@pytest.fixture(scope="module")
def run():
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios))
    return run_harvest(prepare_harvest(scenario))


@pytest.fixture(scope="module")
def summary(run):
    return summarise_harvest(run, "thesis_2")


@pytest.fixture(scope="module")
def small_job():
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), SMALL)
    return prepare_harvest(scenario)


def test_the_field_of_the_thesis_is_harvested_and_the_audit_passes(summary):
    assert summary["finished"]
    assert summary["stopped"] == ""
    assert summary["audit_faults"] == 0
    assert summary["coverage"] >= 0.995
    assert summary["min_combine_to_combine"] >= 0.3
    assert summary["min_cart_to_combine"] >= 0.3
    assert summary["min_cart_to_cart"] is None
    assert summary["min_to_obstacle"] is None
    assert summary["crop_under_bodies"] <= 0.002 * summary["field_area"]


def test_grain_is_conserved_and_all_of_it_delivered(summary):
    harvested = summary["grain_harvested"]
    assert harvested == pytest.approx(110_000.0 * 0.5, rel=0.005)
    assert abs(summary["grain_error"]) <= 1e-9 * harvested
    assert summary["grain_delivered"] == pytest.approx(harvested, rel=1e-9)
    assert summary["grain_lost"] == summary["overflow_time"] == 0.0


def test_two_combines_hardly_wait_and_are_not_much_longer_than_full_headers(summary):
    assert summary["feasible"]
    assert 1.0 < summary["path_over_bound"] < 1.3
    assert 1.0 < summary["makespan_over_bound"] < 1.5
    assert summary["waiting"] <= 0.03
    assert summary["unloads"] >= 4
    assert summary["trips"] >= 1


def test_the_harvest_ends_with_the_last_grain_not_when_somebody_looks(run, summary):
    gone = run.times[np.flatnonzero(run.log["load"].sum(axis=1) > EMPTY).max()]
    assert summary["makespan"] == pytest.approx(gone, abs=2 * LOG_PERIOD)
    assert summary["makespan"] == pytest.approx(summary["makespan_planned"], abs=2.0)


def test_tanks_follow_the_plan_and_none_holds_more_than_it_can(run, summary):
    assert summary["load_deviation"] < 0.01
    assert summary["latest"] < 1.0
    assert run.log["tank"].max() <= run.job.scenario.combines.capacity * (1 + 1e-9)
    assert planned_tanks(run)[-1].max() < 10.0


def test_machines_are_where_the_plan_has_them(run):
    for n, plan in enumerate(run.job.plan.service.plans):
        np.testing.assert_allclose(run.log["pose"][:, n], plan.pose_at(run.times), atol=0.5)
    for k, motion in enumerate(run.job.plan.service.motions):
        off = run.log["state"][:, k, :2] - motion.timed.pose_at(run.times)[:, :2]
        assert np.hypot(*off.T).max() < 0.5


@pytest.mark.parametrize("name", builtin_scenarios(scenarios))
def test_every_scenario_that_comes_along_is_valid(name):
    load_scenario(HarvestScenario, find_scenario(name, scenarios))


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ("combines.tanks=3", r"combines\.tanks"),
        ("disturbance.slow=1", r"disturbance\.slow"),
        ("disturbance.slowness=2", "slowness"),
        ("pattern=spiral", "pattern"),
        ("period=0.8", "period"),
        ("period=0.001", "period"),
        ("carts.count=0", "count"),
        ("combines.count=500", r"`combines\.count` must be at most 100; got 500"),
        ("carts.count=500", r"`carts\.count` must be at most 100; got 500"),
        ("combines.speed=9 t", r"`combines\.speed` must be a number in m/s"),
        ("combines.speed=1e308", r"`combines\.speed` must be at most 100 m/s"),
        ("combines.capacity=300 bu", r"`combines\.capacity` must name the crop"),
        ("field.width=1e306 km", r"`field\.width` must be"),
        ("combines.speed=1e-3", r"`combines\.speed` must be at least 0\.1"),
        ("combines.each=[{speed: 0.01}]", r"`combines\.each\.0\.speed` must be at least 0\.1"),
        ("combines.each=[{}, {mass: -1}]", r"`combines\.each\.1\.mass` must be positive"),
        ("combines.each=[{header_width: 3}]", r"`combines\.each\.0\.header_width` must be a key"),
        ("combines.each=[{}, {}, {}]", r"`combines\.each` must tell of 2 combines at most; got 3"),
        ("carts.acceleration=1e-6", r"`carts\.acceleration` must be at least 0\.05"),
        ("field.trucks=[[1, .nan]]", r"`field\.trucks` must be a finite number"),
        ("field.part=2", r"`field\.part` must come with a file"),
        ("field.coordinates=metres", r"`field\.coordinates` must come with a file"),
        ("field.margin=1e5", r"`field\.margin` must be at most 200 m"),
        ("yields.unit=bu/ac", r"`yields\.unit` must come with a file"),
        ("carts.hitch_offset=inf", r"`carts\.hitch_offset` must be a finite number"),
        ("carts.turning_radius=1e-9", r"`carts\.turning_radius` must be at least 0\.5"),
        ("travel_time=1 km", r"`travel_time` must be a number in s"),
    ],
)
def test_a_setting_that_cannot_be_is_named(setting, named):
    path = find_scenario("thesis_2", scenarios)
    with pytest.raises(InvalidInput, match=named):
        load_scenario(HarvestScenario, path, [setting])


@pytest.mark.parametrize(
    ("source", "says"),
    [
        ({"width": 1e5, "height": 90.0}, "`field` must be at most 10 km long"),
        ({"width": 9e3, "height": 9e3}, "`field` must have at most 1000 ha; got 8100 ha"),
        ({"width": 90.0, "height": 90.0, "origin": (0.0, 90.0)}, "`origin` must be a longitude"),
    ],
)
def test_fields_that_no_plan_can_hold_are_refused_before_it(source, says):
    with pytest.raises(InvalidInput, match=says):
        FieldSource(**source).load()


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("carts.capacity=1", r"`carts\.capacity` must hold at least 27\.5 kg, .*; got 1\.0"),
        ("combines.capacity=1 g", r"`combines\.capacity` must hold at least"),
        ("combines.each=[{}, {capacity: 2}]", r"`combines\.capacity` must hold at least"),
        ("trucks.capacity=1", r"`trucks\.capacity` must hold at least"),
        ("combines.unload_rate=1e-9", r"`combines\.unload_rate` must be at least .* 30 days"),
        ("carts.truck_rate=1e-9", r"`carts\.truck_rate` must be at least .* 30 days"),
        ("trucks={capacity: 1e4, road_time: 1e9}", r"`trucks\.road_time` must be at most"),
    ],
)
def test_tanks_and_augers_with_which_no_harvest_would_end_are_refused_before_a_plan(setting, says):
    # On 11 ha with 5 t/ha: a plan with a million loads went on for ever.
    asked = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), [setting])
    with pytest.raises(InvalidInput, match=says):
        prepare_harvest(asked)
    with pytest.raises(InvalidInput, match=says):
        find_what_it_takes(asked, most=None)


def test_scenarios_have_units():
    settings = [
        "combines.speed=5.4 km/h",
        "combines.header_width=30 ft",
        "combines.capacity=300 bu wheat",
        "carts.capacity=20 t",
        "density=8 t/ha",
        "hours=90 min",
        "disturbance.stops=2 1/h",
    ]
    asked = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), settings)
    assert asked.combines.speed == pytest.approx(1.5)
    assert asked.combines.header_width == pytest.approx(9.144)
    assert asked.combines.capacity == pytest.approx(300 * 60 * 0.45359237)
    assert (asked.carts.capacity, asked.density, asked.hours) == pytest.approx((2e4, 0.8, 1.5))
    assert asked.disturbance.stops == pytest.approx(2.0)


def test_the_timetable_shows_every_second_of_every_machine(small_job):
    figure = draw_timetable(small_job)
    work = small_job.work
    rows, *tanks, carts = figure.axes
    # Thick bars are what combines do; thin ones, when they are emptied.
    for n, plan in enumerate(work.plans):
        bars = [each for each in rows.patches if abs(each.get_y() + BAR / 2 - n) < 1e-9]
        whole = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in bars]
        begins, ends = np.array(sorted(whole)).T
        np.testing.assert_allclose(begins[1:], ends[:-1], atol=1e-6)
        # Whoever has parked with grain is seen to wait for the last cart.
        last = max(visit.end for visit in work.visits if visit.combine == n)
        assert (begins[0], ends[-1]) == pytest.approx((plan.times[0], max(plan.end, last)))
        level = tanks[n].lines[0].get_ydata()
        assert 0.3 < level.max() * 1000 / work.combines[0].capacity <= 1 + 1e-9
        assert level[-1] == pytest.approx(0.0, abs=0.01)
    taken = sum(visit.taken for visit in work.visits)
    assert carts.lines[0].get_ydata().max() * 1000 <= taken + 1e-6
    assert rows.get_xlim()[1] >= work.end


def test_the_map_numbers_every_swath_once_at_its_place_and_names_starts_and_trucks(small_job):
    figure = draw_map(small_job)
    figure.canvas.draw()
    axes = figure.axes[0]
    swaths = swaths_of(small_job.plan)
    labels = [each for each in axes.texts if each.get_text().isdigit() and each.get_bbox_patch()]
    for swath in swaths:
        line = shapely.LineString(swath.points)
        mine = [
            each
            for each in labels
            if each.get_text() == str(swath.number)
            and line.distance(shapely.Point(each.get_position())) < 1e-6
        ]
        assert len(mine) >= 1 or line.length < 0.012 * 144.0
    assert len(labels) <= len(swaths)
    said = {each.get_text() for each in axes.texts}
    assert {"start 0", "start 1", "truck, cart 0", "y (north unknown)"} <= said
    assert "1.08 ha" in figure.get_suptitle()
    # Where carts come, and when.
    visits = small_job.plan.service.visits
    assert len(visits) >= 2
    for visit in visits:
        name = f"{visit.cart}: {visit.begin / 60:.0f}'"
        places = [each.xy for each in axes.texts if each.get_text() == name]
        x, y, _ = small_job.plan.service.plans[visit.combine].pose_at(visit.begin)
        away = [np.hypot(a - x, b - y) for a, b in places]
        assert min(away) == pytest.approx(small_job.reach)


@pytest.mark.parametrize(
    ("size", "length"),
    [(7.9, 1), (8.1, 2), (20.0, 5), (39.0, 5), (41.0, 10), (79.0, 10), (81.0, 20), (4001.0, 1000)],
)
def test_the_scale_is_the_longest_round_length_up_to_a_quarter_of_the_map(size, length):
    axes = Figure().add_subplot()
    _draw_scale(axes, (3.0, -2.0), size)
    black, white = (each.get_xy() for each in axes.patches)
    assert (black[:, 0].min(), black[:, 0].max()) == pytest.approx((3.0, 3.0 + length / 2))
    assert (white[:, 0].min(), white[:, 0].max()) == pytest.approx((3.0 + length / 2, 3.0 + length))
    assert [each.get_text() for each in axes.texts] == ["0", f"{length / 2:g}", f"{length} m"]


def test_names_on_the_map_hide_no_name_and_no_mark(small_job):
    figure = draw_map(small_job)
    figure.canvas.draw()
    axes = figure.axes[0]
    named = [each for each in axes.texts if each.get_text().startswith(("start", "truck"))]
    assert len(named) >= 3
    frames = [shapely.box(*each.get_window_extent().extents) for each in named]
    ends = [
        timed.path.poses[place][:2] for timed in small_job.plan.service.plans for place in (0, -1)
    ]
    numbers = [
        each.get_position()
        for each in axes.texts
        if each.get_text().isdigit() and each.get_bbox_patch()
    ]
    marks = np.concatenate([ends, numbers, small_job.trucks[:, :2]])
    # Numbers keep off the places where carts come, too.
    comes = [each.xy for each in axes.texts if each.get_text().endswith("'")]
    assert len(comes) >= 2
    apart = np.linalg.norm(np.subtract(np.array(numbers)[:, None], np.array(comes)), axis=-1)
    assert apart.min() > 0.02 * 144.0
    shown = shapely.points(axes.transData.transform(marks))
    for k, frame in enumerate(frames):
        assert not frame.intersects(shapely.MultiPoint(shown)), named[k].get_text()
        assert not any(frame.intersects(other) for other in frames[:k]), named[k].get_text()


def command(*words):
    return CliRunner().invoke(make_app(), ["harvest", *words], catch_exceptions=False)


def test_the_command_writes_its_report_and_prints_json(tmp_path):
    out = tmp_path / "out"
    words = [f"--set={each}" for each in SMALL]
    result = command("thesis_2", *words, "--strategy=on-demand", "--out", str(out), "--json")
    assert result.exit_code == 0
    summary = json.loads(result.stdout)
    assert summary["strategy"] == "on-demand"
    assert summary["finished"]
    names = {"summary.json", "log.npz", "log_units.json", "loads.png", "field.png", "replay.html"}
    names |= {"machines.json", "plan.geojson", "TASKDATA", "timetable.png", "map.png"}
    assert {path.name for path in out.glob("[!.]*")} == names
    assert json.loads((out / "plan.geojson").read_text())["coordinates"] == "metres"
    assert read_field(out / "TASKDATA").area == pytest.approx(120 * 90, rel=1e-6)
    log, site = read_harvest(out)
    assert np.diff(log.time).max() <= 0.5
    assert (len(site.combines), len(site.carts), site.margin) == (2, 1, 12.0)
    assert site.parts[0].boundary.area == pytest.approx(120 * 90)
    audit = audit_harvest(log, site)
    assert audit.faults == ()
    for name in ("min_cart_to_combine", "min_combine_to_combine", "crop_under_bodies"):
        assert audit.figures[name] == pytest.approx(summary[name], abs=1e-9)
    assert log.delivered[-1] == pytest.approx(summary["grain_harvested"], rel=1e-9)


def test_where_there_is_no_plan_the_command_exits_with_1_and_says_why():
    result = command("thesis_2", "--set=combines.turning_radius=200", "--json")
    assert result.exit_code == 1
    assert result.stdout == ""
    assert result.stderr.startswith("no plan: ")
    assert "200 m" in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_more_combines_than_there_is_work_for_are_refused_not_dropped():
    small = ["--set=field.width=150", "--set=field.height=100"]
    result = command("thesis_2", *small, "--combines=30", "--json")
    assert result.exit_code == 1
    assert "room for 30 combines" in result.stderr
    assert "a combine has nothing to cut" in result.stderr


def test_more_combines_than_are_told_apart_are_refused_before_anything_is_planned():
    with pytest.raises(InvalidInput, match="`combines` must be at most 32; got 90"):
        command("thesis_2", "--combines=90", "--json")


def test_carts_are_counted_by_an_option_too():
    with pytest.raises(InvalidInput, match=r"carts\.count"):
        command("thesis_2", "--carts=0", "--json")


def test_a_run_that_does_not_finish_exits_with_1_and_says_who_is_where():
    words = [f"--set={each}" for each in [*SMALL, "hours=0.05"]]
    result = command("thesis_2", *words, "--json")
    assert result.exit_code == 1
    summary = json.loads(result.stdout)
    assert not summary["finished"]
    assert summary["stopped"].startswith("the time is up after 180 s; combine 0 is at (")
    assert result.stderr == f"not finished: {summary['stopped']}\n"


def test_a_run_in_which_nothing_moves_any_more_ends(small_job):
    """Nobody empties the combines: they stand with their grain."""
    service = replace(small_job.plan.service, visits=[])
    job = replace(small_job, plan=replace(small_job.plan, service=service))
    run = run_harvest(job)
    assert not run.finished
    assert run.stopped.startswith("nothing has moved since ")
    assert "combine 1 is at (" in run.stopped
    since = float(run.stopped.split(" s;")[0].split()[-1])
    assert STILL <= run.makespan - since <= STILL + 20.0
    assert run.log["tank"].max() <= 3000.0 * (1 + 1e-9)


def test_a_disturbed_run_is_later_and_keeps_the_order(small_job):
    asked = replace(small_job.scenario.disturbance, slowness=0.2, stops=6.0, seed=3)
    job = replace(small_job, scenario=replace(small_job.scenario, disturbance=asked))
    summary = summarise_harvest(run_harvest(job), "late")
    assert summary["finished"]
    assert summary["audit_faults"] == 0
    assert summary["latest"] > 20.0
    assert summary["makespan"] > small_job.plan.makespan + 20.0


def test_a_cart_waits_for_its_truck_in_the_plan_and_in_the_run():
    """One truck of 2 t is away for 10 min whenever it is full."""
    trucks = ["trucks.count=1", "trucks.capacity=2 t", "trucks.road_time=10 min"]
    settings = [*SMALL, *trucks, "carts.capacity=6000"]
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), settings)
    done = run_harvest(prepare_harvest(scenario))
    trips = done.job.plan.service.trips
    flows = sorted(each[1:] for trip in trips for each in trip.fillings)
    assert all(amount <= 2000.0 + 1e-6 for _, _, amount in flows)
    assert any(trip.fillings[0].begin > trip.begin or len(trip.fillings) > 1 for trip in trips)
    assert done.finished
    assert done.makespan == pytest.approx(max(end for _, end, _ in flows), rel=0.02)
    assert done.delivered.sum() == pytest.approx(done.harvested.sum(), rel=1e-9)
    # By the log, grain reaches trucks only while one is there, and no truck gets too much.
    given = np.diff(done.log["delivered"].sum(axis=1))
    loads = [0.0] * len(flows)
    for time, amount in zip(done.times[:-1], given, strict=True):
        if amount > 0:
            here = [k for k, (begin, end, _) in enumerate(flows) if begin - 1 <= time <= end + 1]
            assert here
            loads[here[-1]] += amount
    step = scenario.carts.truck_rate
    assert loads == pytest.approx([amount for _, _, amount in flows], abs=step)

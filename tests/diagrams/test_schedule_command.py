"""`sightfield schedule` answers, draws, and says in one line what is wrong."""

import json

import pytest
import typer
from typer.testing import CliRunner

from sightfield.diagrams.commands.schedule import schedule
from sightfield.diagrams.schedule import summary
from sightfield.systems.numerics.errors import InvalidInput

app = typer.Typer(rich_markup_mode=None)
app.command()(schedule)
BASE = {"--combines": 3, "--capacity": 100, "--fill-rate": 1, "--unload-rate": 12}
PNG = b"\x89PNG"


@pytest.fixture
def run():
    """A function that runs the command, with what it needs; errors come through as exceptions."""

    def invoke(*arguments, **changes):
        given = {key: value for key, value in changes.items() if value is not None}
        options = BASE | {"--" + key.replace("_", "-"): value for key, value in given.items()}
        words = [str(word) for pair in options.items() for word in pair]
        result = CliRunner().invoke(app, [*words, *map(str, arguments)])
        if isinstance(result.exception, Exception):
            raise result.exception
        return result

    return invoke


@pytest.fixture
def report(run):
    """A function that runs the command and returns what it says as JSON."""
    return lambda *arguments, **changes: json.loads(run("--json", *arguments, **changes).stdout)


@pytest.fixture
def answer_alone(monkeypatch):
    """A function after which it is not looked for what to change, which takes longest."""
    return lambda: monkeypatch.setattr(summary, "_remedies", lambda *_: {"combines": 0, "carts": 1})


def test_a_lone_combine_has_no_ways_to_others(report):
    alone, beside = report(combines=1), report(combines=1, travel_time=7)
    assert alone["feasible"] is beside["feasible"] is True
    assert alone["period"] == beside["period"]


def test_three_combines_are_those_of_the_thesis(report):
    found = report(travel_time=15)
    assert found["feasible"] is True
    assert found["travel_time_max"] == pytest.approx((12 - 3) * 100 / (4 * 11))  # (3.7)
    wait = (100 - 2 * 100 / 11 - 4 * 15) / 2  # (3.9), both waits alike
    assert found["waiting_times"] == pytest.approx([wait] * 3)
    assert found["period"] == pytest.approx(100 + 100 / 11 + wait)
    assert found["loads_at_start"] == pytest.approx([100, 3 * 15 + 100 / 11 + wait, 100])
    assert found["binding"] == ["travel_time"]
    assert found["combines_max"] == 12


def test_quantities_with_units_are_the_same_schedule(report):
    plain = report(capacity=9000, fill_rate=20, unload_rate=150, travel_time=60)
    units = report(capacity="9 t", fill_rate="72 t/h", unload_rate="9 t/min", travel_time="1 min")
    assert units["period"] == pytest.approx(plain["period"], rel=1e-12)
    assert units["travel_time_max"] == pytest.approx(plain["travel_time_max"], rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"capacity": "9 m"}, "`capacity` must be a number in kg, .*; got 9 m"),
        ({"capacity": "300 bu"}, "`capacity` must name the crop"),
        ({"capacity": "9 t, 8, 7"}, "`capacity` must have a unit behind each number"),
        ({"fill_rate": "20 t/ha"}, "`fill_rate` must be a number in kg/s"),
        ({"travel_time": "1 km"}, "`travel_time` must be a number in s"),
        ({"cart_capacity": "12 s"}, "`cart_capacity` must be a number in kg"),
    ],
)
def test_wrong_units_are_one_line(run, changes, says):
    with pytest.raises(InvalidInput, match=says) as caught:
        run(**({"travel_time": 15} | changes))
    assert "\n" not in str(caught.value)


def test_an_infeasible_schedule_says_what_to_change(report):
    found = report(travel_time=25)
    assert found["feasible"] is False
    assert found["binding"] == ["travel_time"]
    assert found["period"] is None
    changes = found["remedies"]
    assert changes["travel_time"]["value"] == pytest.approx(900 / 44)
    assert changes["capacity"]["value"] == pytest.approx(100 * 25 * 44 / 900)
    assert changes["unload_rate"] is None
    assert (changes["combines"], changes["carts"]) == (2, 2)
    # What it says is enough.
    assert report(travel_time=25, capacity=changes["capacity"]["value"] * 1.000001)["feasible"]
    assert report(travel_time=25, carts=2)["feasible"]


def test_too_many_combines_are_bound_by_the_unload_rate(report):
    found = report(combines=13, travel_time=0)
    assert found["feasible"] is False
    assert "unload_rate" in found["binding"]
    assert found["travel_time_max"] == pytest.approx((12 - 13) * 100 / (24 * 11))
    assert found["combines_max"] == 12


def test_as_many_combines_as_one_cart_can_unload_leave_no_time_to_drive(report):
    found = report(combines=12, travel_time=0)
    assert found["feasible"] is True
    assert found["travel_time_max"] == pytest.approx(0)
    assert found["period"] == pytest.approx(100 + 100 / 11)
    assert found["loads_when_served"] == pytest.approx([100] * 12)


def test_one_combine_needs_no_limit(report):
    found = report(combines=1, travel_time=1000)
    assert found["feasible"] is True
    assert found["travel_time_max"] is None
    assert found["waiting_times"] == pytest.approx([0])


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,60,x\n60,0,60\n60,60,0", r"`travel_times.0` must be a number in s, .*; got x$"),
        ("0,60,60\n60,5,60\n60,60,0", r"`travel_times` must be 0 from combine 1 to .*; got 5.0$"),
    ],
)
def test_a_table_of_ways_that_cannot_be_is_told_by_row_and_cell(report, tmp_path, rows, message):
    (tmp_path / "ways.csv").write_text(rows)
    with pytest.raises(InvalidInput, match=message):
        report(travel_times=tmp_path / "ways.csv")


def test_combines_of_all_sorts_and_a_truck(report, tmp_path):
    (tmp_path / "ways.csv").write_text("0, 6, 9\n6, 0, 4\n9, 4, 0\n")
    found = report(
        capacity="80,100,140",
        fill_rate="1,0.8,1.5",
        unload_rate="10,12,11",
        travel_times=tmp_path / "ways.csv",
        cart_capacity=400,
        truck_travel_time=10,
        truck_unload_rate=60,
    )
    assert found["feasible"] is True
    assert found["travel_time_max"] is None
    assert found["constraints"]["cart_capacity"]["slack"] > 0
    visits = found["carts"][0]["visits"]
    assert {visit["combine"] for visit in visits} == {0, 1, 2}
    assert any(visit["by_truck"] for visit in visits)


def test_a_cart_that_is_too_small_is_said_to_be(report):
    found = report(travel_time=5, cart_capacity=20, truck_travel_time=30)
    assert found["feasible"] is False
    assert "cart_capacity" in found["binding"]
    enough = found["remedies"]["cart_capacity"]["value"]
    again = report(travel_time=5, cart_capacity=enough, truck_travel_time=30)
    assert again["feasible"] is True


def test_a_plan_for_a_jitter_waits_less(report):
    plain, careful = report(travel_time=10), report(travel_time=10, jitter=0.3)
    assert plain["jitter"] == pytest.approx(0, abs=1e-7)
    assert careful["jitter"] >= 0.3 * (1 - 1e-6)
    assert careful["period"] < plain["period"]


HURRIED = {
    "combines": 4,
    "capacity": "12000,6000,12000,12000",
    "fill_rate": "8,20,8,8",
    "unload_rate": 150,
}


def test_a_combine_in_a_hurry_is_served_twice_a_round(report):
    found = report(**HURRIED, travel_time=50)
    assert found["feasible"] is True
    assert found["certificate"] is None
    assert 61 < found["travel_time_max"] < 67.5
    visited = [visit["combine"] for visit in found["carts"][0]["visits"]]
    assert visited.count(1) > visited.count(0)
    refused = report(**HURRIED, travel_time=70)
    assert refused["feasible"] is False
    assert refused["certificate"]["holds"] == "for every order of visits that empty the tanks"
    enough = refused["remedies"]["travel_time"]["value"]
    assert report(**HURRIED, travel_time=enough)["feasible"] is True


def test_a_smaller_cart_makes_nothing_feasible(report, answer_alone):
    answer_alone()
    four = {"combines": 4, "capacity": 9000, "fill_rate": 20, "unload_rate": 150, "travel_time": 60}
    assert report(**four)["feasible"] is False
    for room in (100, 12_000, 1e6):
        found = report(**four, cart_capacity=room)
        assert found["feasible"] is False
        assert found["certificate"]["travel_scale_max"] < 1
    # The truck is half the longest way from all, unless somebody says where.
    said = report(**four, cart_capacity=12_000, truck_travel_time=90)
    assert said["certificate"] == report(**four, cart_capacity=12_000)["certificate"]
    beside = report(**four, cart_capacity=12_000, truck_travel_time=0)
    assert beside["feasible"] is False
    assert beside["travel_scale_max"] > said["travel_scale_max"]


def test_carts_share_combines_where_no_split_will_do(report, tmp_path):
    found = report(
        combines=6,
        capacity=9000,
        fill_rate=20,
        unload_rate=150,
        travel_time=60,
        carts=4,
        cart_capacity=20_000,
        truck_travel_time=225,
        cycles=6,
        out=tmp_path / "out",
    )
    assert found["feasible"] is True
    assert [cart["combines"] for cart in found["carts"]] == [list(range(6))] * 4
    # What is asked of one cart alone is not asked of four.
    assert found["travel_time_max"] > 60
    assert found["constraints"]["unload_rate"]["slack"] == pytest.approx(1 - 6 * 20 / 150 / 4)
    phases = [cart["phase"] for cart in found["carts"]]
    assert phases == pytest.approx([k / 4 * found["period"] for k in range(4)])
    assert (tmp_path / "out" / "loads.png").read_bytes().startswith(PNG)


def test_what_to_change_is_said_for_carts_that_share(report):
    fleet = {
        "combines": 6,
        "capacity": 9000,
        "fill_rate": 20,
        "unload_rate": 150,
        "travel_time": 60,
    }
    truck = {"carts": 4, "cart_capacity": 20_000}
    found = report(**fleet, **truck, truck_travel_time=240)
    assert found["feasible"] is False
    nearer = found["remedies"]["truck_travel_time"]["value"]
    assert 225 < nearer < 240
    assert report(**fleet, **truck, truck_travel_time=nearer)["feasible"] is True


@pytest.mark.parametrize("travel_time", [15, 25])
def test_the_folder_holds_the_diagram_and_the_summary(run, tmp_path, travel_time):
    out = tmp_path / "out"
    text = run("--json", travel_time=travel_time, out=out).stdout
    assert (out / "loads.png").read_bytes().startswith(PNG)
    assert json.loads((out / "summary.json").read_text()) == json.loads(text)


def test_the_table_is_readable(run):
    said = run(travel_time=15).stdout
    assert "Schedule of 3 combines and 1 cart: feasible" in said
    assert "(binding)" in said
    refused = run(travel_time=25).stdout
    assert "not feasible" in refused
    assert "Change one of these" in refused


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"combines": 0}, "`combines` must be at least 1; got 0"),
        ({"combines": 999}, "`combines` must be at most 20; got 999"),
        ({"capacity": 0}, "`capacity` must be positive; got 0.0"),
        ({"capacity": 1e308}, "`capacity` must lie between 1e-09 and 1e+12; got 1e+308"),
        ({"fill_rate": 1e-308}, "`fill_rate` must lie between 1e-09 and 1e+12; got 1e-308"),
        ({"travel_time": 1e300}, "`travel_time` must be at most 1e+12; got 1e+300"),
        ({"capacity": "nan"}, "`capacity` must be a finite number; got nan"),
        ({"capacity": "1,2"}, "`capacity` must be one number or 3, one for each combine"),
        ({"fill_rate": "many"}, "`fill_rate` must be numbers with commas between; got many"),
        ({"unload_rate": 1}, "`unload_rate` must exceed the fill rate"),
        ({"travel_time": -1}, "`travel_time` must be zero or positive; got -1.0"),
        ({"travel_time": "inf"}, "`travel_time` must be a finite number; got inf"),
        ({"travel_time": "1,2,3"}, "`travel_time` must be one number or 2, one for each gap"),
        ({"travel_times": "nothing.csv"}, "`travel_time` must be left out with travel_times"),
        ({"travel_time": None}, "`travel_time` must be given, or travel_times in a file"),
        ({"carts": 0}, "`carts` must be at least 1; got 0"),
        ({"carts": 100_000}, "`carts` must be at most 20; got 100000"),
        ({"cart_capacity": 0}, "`cart_capacity` must be positive; got 0.0"),
        ({"truck_stop_time": 5}, "`truck_stop_time` must be left out without a cart_capacity"),
        ({"cart_capacity": 9, "truck_travel_time": -5}, "`truck_travel_time` must be zero"),
        ({"fill": 2}, "`fill` must lie above 0 and up to 1; got 2.0"),
        ({"jitter": -1}, "`jitter` must be zero or positive; got -1.0"),
        ({"jitter": 0.1, "fill": 0.5}, "`jitter` must come without fill"),
        ({"jitter": 1e308}, "`jitter` must be at most 1e+12; got 1e+308"),
        (
            {"cart_capacity": 9, "truck_travel_time": 1e308},
            "`truck_travel_time` must be at most 1e+12; got 1e+308",
        ),
        (
            {"cart_capacity": 9, "truck_stop_time": 1e308},
            "`truck_stop_time` must be at most 1e+12; got 1e+308",
        ),
        (
            {"cart_capacity": 9, "truck_unload_rate": 1e-308},
            "`truck_unload_rate` must lie between 1e-09 and 1e+12; got 1e-308",
        ),
        ({"cycles": 0}, "`cycles` must be at least 1; got 0"),
    ],
)
def test_absurd_input_gets_one_line(run, changes, message):
    with pytest.raises(InvalidInput) as caught:
        run(**{"travel_time": 5} | changes)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_cart_that_holds_more_than_any_harvest_is_one_that_never_fills(report):
    # Rounds of as many visits as fill it would be 1e10 visits long.
    asked = {"travel_time": 5, "truck_travel_time": 0}
    huge = report(**asked, cart_capacity=1e12)
    assert huge["feasible"] is True
    assert huge["travel_scale_max"] == pytest.approx(
        report(**asked, cart_capacity=1e5)["travel_scale_max"]
    )


@pytest.mark.parametrize(
    "changes",
    [
        {"capacity": 1e-9, "travel_time": 1},
        {"cart_capacity": 1e12, "truck_stop_time": 1e12, "travel_time": 5},
        {"unload_rate": 1e12, "travel_time": 1e12},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_what_to_change_stays_within_what_can_be_asked(report, changes):
    refused = report(**{"combines": 2} | changes)
    assert refused["feasible"] is False
    for name, change in refused["remedies"].items():
        if isinstance(change, dict):
            assert 1e-9 <= change["value"] <= 1e12, name


def test_the_exit_code_says_whether_there_is_a_schedule(run):
    assert run(travel_time=15).exit_code == 0
    none = run("--json", travel_time=1500)
    assert none.exit_code == 1
    assert json.loads(none.stdout)["feasible"] is False


@pytest.mark.parametrize("asked", [("--jitter", 0.3), ("--fill", 0.3)])
def test_changes_are_those_that_do_what_was_asked_for(report, answer_alone, asked):
    """A little beyond each there is a schedule, and a little short of it there is none."""
    case = {"capacity": 9000, "fill_rate": 20, "unload_rate": 150, "travel_time": 60}
    found = report(*asked, **case)
    assert not found["feasible"]
    changes = found["remedies"]
    answer_alone()
    tried = 0
    for name in case:
        if changes[name] is None:
            continue
        at_most = name in ("travel_time", "fill_rate")
        for off, feasible in ((1e-3, True), (-1e-2, False)):
            value = changes[name]["value"] * (1 - off if at_most else 1 + off)
            assert report(*asked, **case | {name: value})["feasible"] is feasible
        tried += 1
    assert tried >= 3
    assert report(*asked, **case, carts=changes["carts"])["feasible"]
    assert not report(*asked, **case, carts=changes["carts"] - 1)["feasible"]
    assert report(*asked, **case | {"combines": changes["combines"]})["feasible"]


def test_of_more_carts_than_combines_it_is_said_how_many_would_not_do(report, run):
    far = {"combines": 2, "capacity": 9000, "fill_rate": 20, "unload_rate": 150, "travel_time": 60}
    far |= {"cart_capacity": 10000, "truck_travel_time": 1000}
    changes = report(**far)["remedies"]
    assert changes["carts"] is None
    assert changes["carts_more_than"] == 8
    assert not report(**far, carts=8)["feasible"]
    assert report(**far, carts=10)["feasible"]
    assert "more than 8" in run(**far).stdout


def test_roundings_of_nothing_are_nothing(report):
    found = report(combines=1, capacity=9000, fill_rate=20, unload_rate=150, travel_time=60)
    waits, loads = found["waiting_times"], found["loads_when_served"]
    assert all(each == 0.0 or each > 1e-6 for each in [*waits, *loads])

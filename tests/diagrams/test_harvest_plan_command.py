"""`sightfield harvest plan`: figures of a plan and a table of fleets."""

import json

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.systems.numerics.errors import InvalidInput

SMALL = [
    "--set", "field.width=120", "--set", "field.height=90", "--set", "combines.header_width=9",
    "--set", "combines.turning_radius=6", "--set", "combines.capacity=3000", "--yield", "5 t/ha",
]  # fmt: skip


def run(*words: str):
    return CliRunner().invoke(make_app(), ["harvest", "plan", *words])


def test_a_small_field_is_answered_with_picture_and_json(tmp_path):
    out = tmp_path / "out"
    trucks = ["--set", "trucks.capacity=4 t", "--set", "trucks.road_time=10 min"]
    done = run("thesis_2", *SMALL, *trucks, "--most", "2,2,2", "--json", "--out", str(out))
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found == json.loads((out / "fleets.json").read_text(encoding="utf-8"))
    assert (out / "fleets.png").read_bytes().startswith(b"\x89PNG")
    assert found["density"] == pytest.approx(0.5)
    assert len(found["fleets"]) == 8
    assert found["knee"] in found["fleets"]
    plan = found["plan"]
    assert (plan["combines"], plan["carts"]) == (2, 1)
    # What the carts of the model do is what they do in the plan, by and large.
    assert 0.8 < found["model_over_plan"] < 1.25
    assert plan["combine_way"] == pytest.approx(1.08e4 / 9 * 1.35, rel=0.25)
    hours = (plan["combine_engine_time"] + plan["cart_engine_time"]) / 3600
    assert plan["engine_hours"] == pytest.approx(hours)
    assert 8.0 < plan["fuel"] / 1.08 < 60.0


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--most", "6,4"], "most"),
        (["--most", "6,4,99"], "most"),
        (["--yield", "8 m/s"], "density"),
        (["--carts", "0"], "carts"),
        (["--set", "trucks.count=0"], "count"),
        (["--set", "combines.engine_power=1e308"], "engine_power"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(words, named):
    done = run(*words)
    assert isinstance(done.exception, InvalidInput)
    assert named in str(done.exception)
    assert "\n" not in str(done.exception)

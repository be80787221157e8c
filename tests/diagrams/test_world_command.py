"""`sightfield world` reports a world, draws it, and says in one line what is wrong."""

import json

import cv2
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from sightfield.diagrams.commands.world import world
from sightfield.systems.numerics.errors import InvalidInput

app = typer.Typer(rich_markup_mode=None)
app.command()(world)

KEYS = {"obstacles", "vertices", "corners", "free_area", "simplification_error"}


@pytest.fixture
def run():
    """A function that runs the command; errors come through as exceptions."""

    def invoke(*arguments):
        result = CliRunner().invoke(app, [str(each) for each in arguments])
        if isinstance(result.exception, Exception):
            raise result.exception
        return result

    return invoke


@pytest.fixture
def map_file(tmp_path):
    """A room of 18 x 8 cells of 0.5 m, with a box, an unknown box and a wall across a corner."""
    pixels = np.zeros((10, 20), dtype=np.uint8)
    pixels[1:9, 1:19] = 254
    pixels[4:6, 8:10] = 0
    pixels[4:6, 12:14] = 205
    (tmp_path / "map.pgm").write_bytes(b"P5 20 10 255\n" + pixels.tobytes())
    path = tmp_path / "map.yaml"
    path.write_text(
        "image: map.pgm\nresolution: 0.5\norigin: [0.0, 0.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    return path


@pytest.fixture
def field_file(tmp_path):
    path = tmp_path / "field.wkt"
    path.write_text("POLYGON ((6 51, 6.002 51, 6.002 51.001, 6 51.001, 6 51))", encoding="utf-8")
    return path


def test_json_is_one_object_and_nothing_else(run, map_file):
    result = run(map_file, "--json")
    report = json.loads(result.stdout)
    assert report.keys() >= KEYS
    assert (report["obstacles"], report["vertices"], report["corners"]) == (2, 12, 8)
    assert report["free_area"] == pytest.approx(136 * 0.25)
    assert report["simplification_error"] == 0.0
    assert (report["source"], report["bounds"]) == ("map_server", [0.5, 0.5, 9.5, 4.5])
    assert (result.exit_code, result.stderr) == (0, "")


def test_without_json_a_table_shows_the_same(run, map_file):
    shown = run(map_file).stdout
    assert set(shown.split()) >= KEYS
    assert "m^2" in shown
    assert "34" in shown.split()


def test_the_options_reach_the_map(run, map_file):
    def report(*options):
        return json.loads(run(map_file, "--json", *options).stdout)

    assert report("--unknown", "free")["obstacles"] == 1
    assert report("--speckle", "1.5")["obstacles"] == 0
    assert report("--speckle", "1.5")["speckle_area"] == pytest.approx(2.0)
    assert report("--speckle", "1.5", "--wall", "100")["obstacles"] == 0
    assert report("--tolerance", "0.01")["simplification_error"] == 0.0


def test_degrees_are_projected_on_demand(run, field_file):
    report = json.loads(run(field_file, "--wgs84", "--json").stdout)
    assert report["geographic_origin"] == pytest.approx([6.001, 51.0005])
    # 0.002 degrees east by 0.001 degrees north at 51 degrees.
    assert report["free_area"] == pytest.approx(140.4 * 111.25, rel=1e-3)
    with pytest.raises(InvalidInput, match="looks like degrees"):
        run(field_file, "--json")


def test_the_picture_shows_free_space_obstacles_corners_and_what_lies_beyond(run, map_file):
    out = map_file.parent / "results"
    run(map_file, "--out", out)
    assert sorted(file.name for file in out.glob("[!.]*")) == ["summary.json", "world.png"]
    picture = cv2.imread(str(out / "world.png"))
    assert picture is not None
    colours = {tuple(colour) for colour in picture.reshape(-1, 3)[:, ::-1].tolist()}
    white, green, red, gray = (255, 255, 255), (58, 157, 93), (214, 39, 40), (217, 220, 223)
    assert {white, green, red, gray} <= colours
    # One obstacle is left of the middle, one right of it; neither above nor below it.
    rows, columns = np.nonzero((picture[:, :, ::-1] == green).all(axis=2))
    height, width = picture.shape[:2]
    assert columns.min() < width / 2 < columns.max()
    assert height / 4 < rows.min() < rows.max() < 3 * height / 4


def test_the_summary_in_the_folder_is_the_one_printed(run, map_file):
    printed = run(map_file, "--json", "--out", map_file.parent / "results").stdout
    written = (map_file.parent / "results" / "summary.json").read_text(encoding="utf-8")
    assert json.loads(printed) == json.loads(written)


def test_a_name_with_marks_that_mean_something_elsewhere_is_no_trouble(run, field_file):
    # To the table's markup and to the picture's formulas.
    odd = field_file.rename(field_file.with_name("a[b] $x$ $.wkt"))
    assert "a[b]" in run(odd, "--wgs84", "--out", odd.parent / "results").stdout


def test_bad_input_leaves_no_folder(run, map_file):
    out = map_file.parent / "results"
    (map_file.parent / "map.pgm").write_bytes(b"P5 20 10 255\n")
    with pytest.raises(InvalidInput, match="`image` must hold the 20 x 10 pixels"):
        run(map_file, "--json", "--out", out)
    assert not out.exists()


def test_help_states_the_units(run):
    shown = run("--help").stdout
    assert "m^2" in shown
    assert "[m]" in shown
    assert "[deg]" in shown

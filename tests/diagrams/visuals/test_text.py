"""Text is drawn as the areas of its letters, and digits show numbers as a clock does."""

import pytest
import shapely
from pydrake.geometry import Rgba

from sightfield.diagrams.visuals.stage import Stage
from sightfield.diagrams.visuals.text import Digits, advance, text_mesh


def cover(mesh) -> shapely.Geometry:
    return shapely.union_all(shapely.polygons(mesh.vertices[:2].T[mesh.faces.T]))


def test_a_capital_is_as_high_as_asked_for():
    left, bottom, _, top = cover(text_mesh("H", 2.0)).bounds
    assert top - bottom == pytest.approx(2.0, rel=0.01)
    assert bottom == pytest.approx(0.0, abs=0.02)
    assert left > 0


@pytest.mark.parametrize(("letter", "holes"), [("I", 0), ("O", 1), ("8", 2)])
def test_letters_have_their_holes(letter, holes):
    shape = cover(text_mesh(letter, 1.0))
    assert isinstance(shape, shapely.Polygon)
    assert len(shape.interiors) == holes


def test_digits_are_all_equally_wide():
    assert {round(advance(str(digit), bold=True), 6) for digit in range(10)} == {
        round(advance("0", bold=True), 6)
    }


def test_a_line_is_as_long_as_its_letters_and_spaces_count():
    assert advance("00") == pytest.approx(2 * advance("0"))
    assert advance("a b") > advance("ab")


def test_bold_letters_are_heavier():
    assert text_mesh("H", 1.0, bold=True).area > 1.3 * text_mesh("H", 1.0).area


def test_centred_text_lies_about_its_origin():
    left, bottom, right, top = cover(text_mesh("H", 1.0, align="centre")).bounds
    assert left == pytest.approx(-right)
    assert bottom == pytest.approx(-top, abs=0.01)


class ShownLog(Stage):
    """A stage that knows what is shown on it."""

    def __init__(self, meshcat) -> None:
        super().__init__(meshcat, "/stage", recording=False, period=1.0, tolerance=1e-3)
        self.shown: dict[str, bool] = {}

    def show(self, path: str, visible: bool) -> None:
        self.shown[path] = visible

    def text(self) -> str:
        """The digits that are shown, from left to right."""
        lit = sorted((path.split("/")[1:] for path, on in self.shown.items() if on), reverse=True)
        assert len({place for place, _ in lit}) == len(lit), "two digits at one place"
        return "".join(digit for _, digit in lit)


@pytest.fixture
def stage(meshcat_log) -> ShownLog:
    return ShownLog(meshcat_log)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "00"),
        (0.1, "01"),
        (9.99, "99"),
        (0.3 - 1e-12, "03"),
        (10.0, "100"),
        (1234.5, "12345"),
        (99999.0, "99999"),
    ],
)
def test_a_clock_shows_tenths_without_leading_zeros(stage, number, text):
    clock = Digits(stage, "clock", 1.0, Rgba(), places=5, decimals=1)
    clock.show(number)
    assert stage.text() == text


def test_a_count_shows_whole_numbers(stage):
    count = Digits(stage, "count", 1.0, Rgba(), places=2)
    for number in (0, 7, 10, 3):
        count.show(number)
        assert stage.text() == str(number)


def test_the_point_makes_the_clock_wider(stage):
    plain = Digits(stage, "plain", 1.0, Rgba(), places=3)
    clock = Digits(stage, "clock", 1.0, Rgba(), places=3, decimals=1)
    assert clock.width > plain.width

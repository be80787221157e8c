"""Text is drawn as the areas of its letters."""

import pytest
import shapely

from sightfield.diagrams.visuals.text import advance, text_mesh


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

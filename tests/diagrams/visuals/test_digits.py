"""Digits show numbers as a clock does."""

import pytest
from pydrake.geometry import Rgba

from sightfield.diagrams.visuals.digits import Digits
from sightfield.diagrams.visuals.stage import Stage


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

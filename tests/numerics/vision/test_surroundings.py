"""The coloured shells."""

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.surroundings import SHELL_COLOURS, Shell, shell_of


def test_a_shell_has_the_colour_that_it_is_named_for():
    shell = shell_of("green", radius=0.08)
    assert shell == Shell(radius=0.08, colour=SHELL_COLOURS["green"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": -0.1}, "`radius` must be positive; got -0.1"),
        ({"base": 0.3}, "`top` must be above the base, 0.3 m; got 0.2"),
        ({"colour": (0, 0, 256)}, "`colour` must hold whole numbers 0 to 255; got 256"),
    ],
)
def test_impossible_shells_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        Shell(**change)


def test_unknown_colours_are_refused_with_the_known_ones():
    with pytest.raises(InvalidInput, match=r"be one of red, green.*; got 'puce'"):
        shell_of("puce")

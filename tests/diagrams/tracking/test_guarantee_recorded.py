"""What `sightfield guarantee` and `sightfield corner` say, draw and leave is as recorded."""

import pytest


@pytest.mark.parametrize(
    "words",
    [
        "corner_1v1 --grid 0.4",
        "corner_1v1 --grid 0.4 --bound lower --speed-ratio 0.5 --sight-range 3",
        "corner_1v1 --grid 0.4 --bound upper --pursuer 1.7 -2.2 --evader 0.4 1.3 --horizon 30",
    ],
)
def test_a_guarantee_is_as_recorded(words, as_it_was):
    as_it_was("guarantee", *words.split())


@pytest.mark.parametrize(
    "words",
    [
        "",
        "--alpha 1.1 --ratio 0.3 --pursuer 1.2 -1.4 --evader -0.4 0.9 --speed 1.3 --field table",
        "--alpha 2.1 --ratio 0.8 --pursuer 0.9 -0.7 --evader 0.3 1.1 --field table_up",
    ],
)
def test_a_corner_is_as_recorded(words, as_it_was):
    as_it_was("corner", *words.split())

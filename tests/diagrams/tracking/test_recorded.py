"""What `sightfield track` says, draws, shows and leaves is as it was recorded."""

import pytest


@pytest.mark.parametrize(
    "words",
    [
        "corner_1v1 --seconds 1.2",
        "thesis_3v4 --seconds 1 --seed 3",
        "thesis_borda_4v3 --seconds 0.6 --no-replay",
        "risk_vectors --seconds 0.5 --no-replay",
    ],
)
def test_a_game_is_as_recorded(words, as_it_was):
    as_it_was("track", *words.split())

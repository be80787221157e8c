"""What `sightfield social` says, draws, shows and leaves is as it was recorded."""

import pytest

STANDING = (
    "agents.speed=0.001",
    "agents.poses=[[1.47, 1.73, -2.08], [1.02, 0.48, 1.57], [0.39, 1.42, -0.54]]",
    "evader={policy: rest, pose: [1.1, 1.1, 0.4]}",
    "pursuer.pose=[0.25, 0.6, 1.57]",
    "agents.unfriending=[0, 0, 0]",
    "agents.friending=[1, 1, 1]",
)


@pytest.mark.parametrize(
    ("words", "settings", "besides"),
    [
        ("thesis_maze --seconds 3", STANDING, ()),
        ("choosy_crowd --seconds 1.5 --seed 4 --no-replay", (), ()),
    ],
    ids=["standing", "choosy"],
)
def test_a_search_is_as_recorded(words, settings, besides, as_it_was):
    options = [each for setting in settings for each in ("--set", setting)]
    as_it_was("social", *words.split(), *options, besides=besides, relative=1e-4)

"""What `sightfield harvest` says, draws, shows and leaves is as it was recorded."""

import pytest

SMALL = (
    "--set field.width=120 --set field.height=90 --set combines.header_width=9 "
    "--set combines.turning_radius=6 --set combines.capacity=1500"
)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (f"thesis_2 {SMALL} --set hours=0.1", 1),
        (f"thesis_2 {SMALL} --strategy on-demand --combines 1 --carts 2 --no-replay", 0),
    ],
    ids=["sequential", "on-demand"],
)
def test_a_harvest_is_as_recorded(words, code, as_it_was):
    as_it_was("harvest", "run", *words.split(), code=code, relative=1e-5)


def test_what_a_harvest_takes_is_as_recorded(as_it_was):
    trucks = "--set trucks.capacity=4t --set trucks.road_time=600 --yield 5t/ha --most 2,2,2"
    words = f"thesis_2 {SMALL} {trucks}"
    as_it_was("harvest", "plan", *words.split(), relative=1e-5)

"""What `sightfield standoff` says, draws, shows and leaves of a loop is as it was recorded."""

import pytest

GAINS = "--kp 7 --ki 3.5 --kd 0.6"
CLOCK = "--period 0.02 --filter-time 0.05 --delay 0.04 --limit 0.5"
SCENE = ("scene",)
# Motions that are lost go as far as rounding has it.
FAR = ("sampled_region.png", "phase.png")


@pytest.mark.parametrize(
    ("words", "besides"),
    [
        (f"analyse --controller PI {GAINS} {CLOCK} --reference 0.3 --start 0.5", FAR),
        (f"analyse --controller PD {GAINS} --start 0.4", SCENE),
        (f"run --controller P {GAINS} {CLOCK} --evader-speed 0.2", SCENE),
    ],
    ids=["PI", "PD", "P"],
)
def test_a_loop_is_as_recorded(words, besides, as_it_was):
    as_it_was("standoff", *words.split(), besides=besides, relative=1e-5)


@pytest.mark.parametrize(
    "words",
    [
        f"analyse --controller P {GAINS} {CLOCK} --json",
        f"design --controller PI {CLOCK} --phase-margin 50 --gain-margin 2.5",
    ],
    ids=["P", "design"],
)
def test_what_is_said_of_a_loop_is_as_recorded(words, as_it_was):
    as_it_was("standoff", *words.split(), out=False, relative=1e-5)

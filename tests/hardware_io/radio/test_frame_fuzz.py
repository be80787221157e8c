"""A million damaged frames are refused by the work station's decoder."""

import random

from sightfield.hardware_io.radio.frames import FrameError, decode, encode
from sightfield.hardware_io.radio.messages import RobotFlag, RobotState, Telemetry

REPORT = Telemetry(
    session=7,
    sequence=9,
    robot=3,
    state=RobotState.DRIVING,
    flags=RobotFlag(0),
    last_sequence=1000,
    hold=5,
    counts=(-20, 40),
    speeds=(100, -100),
    ranges=(400, 123, 7, 0),
    battery=7600,
    taken=12,
    refused=0,
)


def test_a_million_damaged_reports_are_refused():
    whole, rng = encode(REPORT), random.Random(0)
    refused = 0
    for _ in range(10**6):
        damaged = bytearray(whole)
        # A byte changes, or several; or the frame ends early; or it is noise altogether.
        way = rng.getrandbits(3)
        if way == 0:
            damaged = rng.randbytes(rng.getrandbits(6))
        elif way == 1:
            del damaged[rng.getrandbits(5) :]
        else:
            at = int(rng.random() * len(damaged))
            damaged[at : at + way] = rng.randbytes(way - 1)
        if damaged == whole:
            continue
        try:
            decode(damaged)
        except FrameError:
            refused += 1
        else:
            raise AssertionError(f"{damaged.hex()} was taken")
    assert refused > 990_000

"""Encoders are compared with what the motion capture sees as closely as the moment allows."""

import numpy as np

from sightfield.systems.numerics.station.motion_checks import (
    Chassis,
    check_motion,
    no_motion,
    with_sent,
)
from sightfield.systems.numerics.station.supervision import Reason

CHASSIS, PERIOD = Chassis(), 0.05


def test_a_robot_that_was_fast_a_moment_ago_is_compared_as_closely_as_any_slow_one():
    """It slows down from 0.3 to 0.05 m/s, and an encoder dies 0.5 s later."""
    slows, slow, dies = 2.0, 0.05, 2.5

    def way(time):
        return 0.3 * min(time, slows) + slow * max(time - slows, 0.0)

    for phase in np.arange(0.0, 0.2, 0.02):
        memory, noticed = no_motion(1), None
        for moment in np.arange(0.0, 4.0, PERIOD):
            told = 0.2 * np.floor((moment - CHASSIS.report_delay - phase) / 0.2) + phase
            ways = np.array([way(min(told, dies)), way(told)])
            memory, faults = check_motion(
                CHASSIS,
                memory,
                time=moment,
                period=PERIOD,
                poses=np.array([[way(moment - 0.01), 0.0, 0.0]]),
                good=np.ones(1, bool),
                stamps=np.array([moment - 0.01]),
                pose_ages=np.array([0.01]),
                counts=np.rint(ways * CHASSIS.counts_per_metre)[None],
                ages=np.array([moment - CHASSIS.report_delay - told]),
            )
            memory = with_sent(CHASSIS, memory, np.array([[slow, 0.0]]))
            if faults[0] == Reason.ODOMETRY and noticed is None:
                noticed = moment
        # 12 mm and what moments that are off explain, of which slip takes a quarter; two reports.
        least = (0.012 + 0.04 * 2 * slow) / (0.75 * slow)
        assert noticed is not None
        assert dies + least - 0.05 < noticed < dies + least + 0.45

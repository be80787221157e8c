"""What is promised is withdrawn from who is deflected, and from nobody else."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.tracking.guaranteed_time import StandingCertificate


def evaluate(times, assignment, deflection, evaders=2):
    system = StandingCertificate(pursuers=len(times), evaders=evaders, top_speed=0.3)
    context = system.CreateDefaultContext()
    system.GetInputPort("guaranteed_time").FixValue(context, times)
    system.GetInputPort("assignment").FixValue(context, assignment)
    system.GetInputPort("deflection").FixValue(context, deflection)
    return (
        float(system.GetOutputPort("certificate").Eval(context)[0]),
        system.GetOutputPort("withdrawn").Eval(context).tolist(),
    )


def test_without_deflection_the_evader_that_is_kept_the_shortest_counts():
    assert evaluate([4.0, 7.0, 5.0], [0, 1, 0], [0, 0, 0]) == (5.0, [0, 0, 0])
    # By rounding nobody is deflected.
    assert evaluate([4.0, np.inf], [0, 1], [1e-8, 1e-8]) == (4.0, [0, 0])


def test_who_is_deflected_promises_nothing():
    assert evaluate([4.0, 7.0], [0, 1], [0.0, 0.02]) == (0.0, [0, 1])
    assert evaluate([4.0, 7.0], [0, 1], [0.01, 0.0]) == (0.0, [1, 0])
    # Another one still has the evader.
    assert evaluate([4.0, 7.0, 5.0], [0, 1, 0], [0, 0, 0.1]) == (4.0, [0, 0, 1])


def test_who_has_promised_nothing_has_nothing_to_withdraw():
    assert evaluate([0.0, 7.0], [0, 1], [0.1, 0.0]) == (0.0, [0, 0])


def test_nonsense_is_refused():
    with pytest.raises(InvalidInput, match="top_speed"):
        StandingCertificate(pursuers=1, evaders=1, top_speed=0.0)

"""Whom it is worth to ask, as a system."""

import math

import numpy as np
import pytest
from pydrake.common.value import AbstractValue

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.localisation.location import (
    CameraPose,
    Outcome,
    Reading,
    no_location,
)
from sightfield.systems.numerics.social.network.interface import Picture
from sightfield.systems.numerics.social.recognition.recognition import NOTHING
from sightfield.systems.numerics.social.routes.outlook import make_outlook
from sightfield.systems.social.network_evolution import AgentInterest

ROOM = make_world([[0, 0], [4, 0], [4, 4], [0, 4]])
OUTLOOK = make_outlook(ROOM, cell=0.2, view_angle=1.2, reach=2.5)


def reading(agent, time, pose):
    camera = CameraPose(np.array(pose), np.eye(3), 0.0, (1,))
    picture = Picture(id=f"{agent}", agent=agent, time=time, data=b"")
    return Reading(picture, NOTHING, no_location(Outcome.NO_EVADER, camera))


@pytest.fixture
def ask():
    """A function of readings, tallies, a time and where the evader was: each agent's interest."""

    def interest(*readings, tallies=((0, 0),) * 3, time=0.0, covariance=0.05):
        system = AgentInterest(OUTLOOK, agents=3, patience=2, forgetting=10.0)
        context = system.CreateDefaultContext()
        context.SetTime(time)
        system.GetInputPort("tallies").FixValue(context, np.ravel(tallies).astype(float))
        system.GetInputPort("evader_position").FixValue(context, [2.0, 2.0])
        spread = np.diag([covariance, covariance]).ravel()
        system.GetInputPort("evader_covariance").FixValue(context, spread)
        system.GetInputPort("readings").FixValue(context, AbstractValue.Make(tuple(readings)))
        state = system.EvalUniquePeriodicDiscreteUpdate(context)
        context.SetDiscreteState(state)
        return system.GetOutputPort("interest").Eval(context)

    return interest


def test_strangers_of_whom_nothing_is_known_are_alike(ask):
    assert ask() == pytest.approx(np.full(3, ask()[0]))
    assert ask()[0] > 0


def test_who_looks_where_the_evader_is_believed_is_asked_first(ask):
    towards, away = reading(0, 0.0, [1.0, 2.0, 0.0]), reading(1, 0.0, [1.0, 2.0, math.pi])
    first, second, unknown = ask(towards, away)
    assert first > unknown > second


def test_what_is_known_of_a_camera_fades(ask):
    towards = reading(0, 0.0, [1.0, 2.0, 0.0])
    fresh, old, oldest = (
        ask(towards, time=time)[0] / ask(towards, time=time)[1] for time in (0, 10, 100)
    )
    assert fresh > old > oldest == pytest.approx(1, abs=0.01)


def test_who_accepts_readily_is_asked_first(ask):
    ready, coy, unknown = ask(tallies=((8, 1), (1, 8), (0, 0)))
    assert ready > unknown > coy


def test_before_the_first_location_every_place_counts(ask):
    # Looking along the room's length shows more than looking into a corner.
    wide, narrow = reading(0, 0.0, [0.3, 2.0, 0.0]), reading(1, 0.0, [0.3, 0.3, -2.3])
    first, second, _ = ask(wide, narrow, covariance=math.inf)
    assert first > second

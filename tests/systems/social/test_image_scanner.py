"""The scanner hands on each new picture of a friend once."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    OwnAcceptance,
    Temperaments,
)
from sightfield.systems.numerics.social.network.interface import Picture
from sightfield.systems.social.network_evolution import ImageScanner


class Bench:
    """A scanner of two agents that are friends of the pursuer as soon as it looks."""

    def __init__(self, **settings):
        willing = Temperaments(
            acceptance=OwnAcceptance((1.0, 1.0)), unfriending=(0.0, 0.0), rejection=(0.0, 0.0)
        )
        self.network = MemoryNetwork(willing, 0)
        self.system = ImageScanner(self.network, **settings)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.connect(1, 1)
        self.simulator.Initialize()
        for agent in (0, 1):
            self.network.request(agent)
        self.network.advance(0)

    def connect(self, *connected):
        self.system.GetInputPort("connected").FixValue(
            self.context, np.array(connected, dtype=float)
        )

    def post(self, agent, number):
        made = Picture(id=f"{agent}-{number}", agent=agent, time=float(number), data=b"x")
        self.network.post(agent, made)
        return made

    def look(self, time):
        self.simulator.AdvanceTo(time)
        return (
            self.system.GetOutputPort("pictures").Eval(self.context),
            self.system.GetOutputPort("pictures_scanned").Eval(self.context).tolist(),
        )


def test_each_new_picture_of_a_friend_is_handed_on_once_and_counted():
    bench = Bench(period=1.0)
    assert bench.look(0.5) == ((), [0])
    first, other = bench.post(0, 0), bench.post(1, 0)
    assert bench.look(1.5) == ((first, other), [2])
    assert bench.look(2.5) == ((), [2])
    second = bench.post(0, 1)
    assert bench.look(3.5) == ((second,), [3])


def test_only_the_albums_of_connected_agents_are_read_and_at_most_n_img_of_each():
    bench = Bench(period=1.0, count=2)
    pictures = [bench.post(agent, number) for agent in (0, 1) for number in range(3)]
    bench.connect(0, 1)
    assert bench.look(0.5) == (tuple(pictures[4:]), [2])


def test_a_friend_that_left_a_moment_ago_does_not_stop_the_scan():
    bench = Bench(period=1.0)
    bench.post(0, 0)
    left = bench.post(1, 0)
    bench.network.withdraw(0)
    assert bench.look(0.5) == ((left,), [1])


def test_initialising_again_starts_the_count_afresh():
    bench = Bench(period=1.0)
    bench.post(0, 0)
    assert bench.look(1.5)[1] == [1]
    bench.simulator.Initialize()
    assert bench.system.GetOutputPort("pictures_scanned").Eval(bench.context).tolist() == [0]


@pytest.mark.parametrize(("name", "value"), [("count", 0), ("period", 0.0)])
def test_settings_out_of_range_are_refused(name, value):
    willing = Temperaments(acceptance=OwnAcceptance((1.0,)), unfriending=(0.0,), rejection=(0.0,))
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        ImageScanner(MemoryNetwork(willing, 0), **{name: value})

"""The system runs Algorithm 2 once a period, and repeats a run exactly."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    OwnAcceptance,
    Temperaments,
    thesis_temperaments,
)
from sightfield.systems.numerics.social.network.evolution import (
    EvolutionLimits,
    evolve,
    strangers,
)
from sightfield.systems.social.network_evolution import NetworkEvolution


def read(system, context, name):
    return system.GetOutputPort(name).Eval(context).tolist()


def test_ports_are_as_documented():
    system = NetworkEvolution(MemoryNetwork(thesis_temperaments(), 0))
    inputs = [system.get_input_port(i) for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i) for i in range(system.num_output_ports())]
    assert [(port.get_name(), port.size()) for port in inputs] == [("interest", 3)]
    assert [(port.get_name(), port.size()) for port in outputs] == [
        ("connected", 3),
        ("waiting", 3),
        ("counters", 3),
        ("tallies", 6),
        ("requests_sent", 1),
        ("iteration", 1),
    ]


def test_it_does_what_the_algorithm_does_by_itself_one_iteration_a_period():
    system = NetworkEvolution(MemoryNetwork(thesis_temperaments(), 4), period=0.5)
    simulator = Simulator(system)
    context = simulator.get_context()
    network, known, sent = MemoryNetwork(thesis_temperaments(), 4), strangers(3), 0
    for iteration in range(40):
        simulator.AdvanceTo(0.5 * iteration + 0.25)
        done = evolve(network, known, EvolutionLimits(), iteration)
        known, sent = done.known, sent + done.requests_sent
        assert read(system, context, "connected") == [float(i in known.friends) for i in range(3)]
        assert read(system, context, "waiting") == [float(i in known.waiting) for i in range(3)]
        assert read(system, context, "counters") == [max(each, 0) for each in known.status]
        assert read(system, context, "requests_sent") == [sent]
        assert read(system, context, "iteration") == [iteration + 1]
    tallies = np.reshape(read(system, context, "tallies"), (3, 2))
    assert (tallies[:, 0] > 0).all()
    assert tallies.sum() > 3


def test_initialising_again_repeats_the_run():
    system = NetworkEvolution(MemoryNetwork(thesis_temperaments(), 4))
    runs = []
    for _ in range(2):
        simulator = Simulator(system)
        simulator.AdvanceTo(30.5)
        context = simulator.get_context()
        runs.append([read(system, context, name) for name in ("connected", "tallies")])
    assert runs[0] == runs[1]


def test_the_most_interesting_agent_is_asked_when_only_one_can_be():
    system = NetworkEvolution(
        MemoryNetwork(thesis_temperaments(), 0), EvolutionLimits(requests=1, friends=1)
    )
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.GetInputPort("interest").FixValue(context, np.array([0.0, 0.5, 1.0]))
    simulator.AdvanceTo(0.5)
    tallies = np.reshape(read(system, context, "tallies"), (3, 2))
    assert tallies.sum(axis=1).tolist() == [0, 0, 1]


def test_friends_that_the_network_remembers_are_friends_from_the_start():
    class Remembering(MemoryNetwork):
        """Never forgets that agent 1 is a friend."""

        def begin(self):
            super().begin()
            self._friends.add(1)

    never = Temperaments(
        acceptance=OwnAcceptance((0.0, 0.0)), unfriending=(0.0, 0.0), rejection=(0.0, 0.0)
    )
    system = NetworkEvolution(Remembering(never, 0))
    simulator = Simulator(system)
    simulator.AdvanceTo(0.5)
    assert read(system, simulator.get_context(), "connected") == [0, 1]


def test_a_period_must_be_positive():
    with pytest.raises(InvalidInput, match="`period`"):
        NetworkEvolution(MemoryNetwork(thesis_temperaments(), 0), period=0)

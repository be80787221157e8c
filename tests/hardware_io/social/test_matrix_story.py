"""Network evolution and scanning, as systems in a simulation, through a real homeserver."""

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from sightfield.hardware_io.social.matrix_network import MatrixNetwork
from sightfield.systems.numerics.social.network.evolution import EvolutionLimits
from sightfield.systems.numerics.social.network.interface import Answer
from sightfield.systems.social.network_evolution import ImageScanner, NetworkEvolution

PERIOD = 0.2


class Diary(MatrixNetwork):
    """Remembers what the agents answered."""

    def __init__(self, *arguments, **settings):
        super().__init__(*arguments, **settings)
        self.answers = []

    def responses(self):
        found = super().responses()
        self.answers += [each.answer for each in found]
        return found


def test_a_simulation_makes_friends_is_rejected_left_and_cut_off_and_reads_every_picture_once(maze):
    """A server that is restarted in mid-run among the rest."""
    temperaments = maze.always((0.6, 0.6, 0.0), (0.1, 0.1, 0.0), (0.5, 0.5, 1.0))
    with Diary(maze.directory(3), temperaments, seed=1) as network:
        builder = DiagramBuilder()
        limits = EvolutionLimits(requests=3, patience=10, friends=3)
        evolution = builder.AddSystem(NetworkEvolution(network, limits, period=PERIOD))
        scanner = builder.AddSystem(ImageScanner(network, count=16, period=PERIOD))
        builder.Connect(evolution.GetOutputPort("connected"), scanner.GetInputPort("connected"))
        builder.ExportOutput(evolution.GetOutputPort("connected"), "connected")
        builder.ExportOutput(scanner.GetOutputPort("pictures"), "pictures")
        diagram = builder.Build()
        simulator = Simulator(diagram)
        simulator.Initialize()
        # The server's time is real time.
        simulator.set_target_realtime_rate(1.0)
        context = simulator.get_context()
        posted, read, period, most = [], [], 0, 0

        def go_on():
            """One period; every other time somebody posts."""
            nonlocal period, most
            if period % 2 == 0 and len(posted) < 20:
                made = maze.picture(period // 2 % 2, period)
                posted.append(made)
                network.post(made.agent, made)
            # Half a period past the systems' last event.
            simulator.AdvanceTo(PERIOD * (period + 0.5))
            period += 1
            read.extend(diagram.GetOutputPort("pictures").Eval(context))
            most = max(most, int(diagram.GetOutputPort("connected").Eval(context).sum()))

        def until(holds):
            while not holds():
                assert context.get_time() < 60, f"{len(read)} of {len(posted)}, {network.answers}"
                go_on()

        until(lambda: {Answer.ACCEPTED, Answer.REJECTED} <= set(network.answers) and len(read) > 1)
        known = len(read)
        with maze.synapse.down():
            for _ in range(5):
                go_on()
        until(lambda: Answer.UNFRIENDED in network.answers and len(read) > known + 2)
        until(lambda: len(posted) == 20 and len(read) == len(posted))
        assert sorted(read, key=lambda each: each.id) == sorted(posted, key=lambda each: each.id)
        assert 1 <= most <= 2
        assert np.isin(diagram.GetOutputPort("connected").Eval(context), (0, 1)).all()

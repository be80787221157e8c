"""Games of evaders that play by the solved visibility game."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.world_source import WorldSource

POLICIES = ("optimal", "optimal_distance")
BOXES = [
    [[1.53, 1.41], [2.71, 1.41], [2.71, 2.57], [1.53, 2.57]],
    [[0.4, 3.0], [1.2, 3.0], [1.2, 3.45], [0.4, 3.45]],
]


def make_game(policy, pursuers, evaders, *, mapped=np.asarray, evading=None, **pursuing):
    """Teams in an arena of two boxes, all of it carried elsewhere."""

    def carried(points):
        return mapped(np.array(points)).tolist()

    chasing = {"top_speed": 0.3, "grid": 0.15, "smoothing": 0.0} | pursuing
    return set_up_game(
        TrackingScenario(
            world=WorldSource(
                boundary=carried([[0, 0], [4, 0], [4, 4], [0, 4]]),
                obstacles=[carried(box) for box in BOXES],
            ),
            pursuers=Pursuers(positions=carried(pursuers), **chasing),
            evaders=Evaders(
                positions=carried(evaders), top_speed=0.09, policies=[policy], **(evading or {})
            ),
            seconds=30.0,
        )
    )


class Standing(LeafSystem):
    """A pursuit that wants nothing."""

    def __init__(self):
        super().__init__()
        self.DeclareVectorOutputPort("velocity", 2, lambda context, output: output.SetZero())


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize(
    ("pursuer", "evader", "way"),
    [
        # Right to the corner (2.71, 1.41) and round it.
        ((0.7, 0.7), (1.9, 1.13), 0.9),
        # Up past the box's other corner.
        ((1.9, 0.5), (1.2, 1.9), 0.9),
    ],
)
def test_a_pursuer_that_stands_still_soon_loses_it(policy, pursuer, evader, way):
    run = run_tracking(make_game(policy, [pursuer], [evader]), pursuit=Standing())
    assert run.lost_evader == 0
    assert run.tracking_time < 1.6 * way / 0.09


MAPS = {
    "mirrored": lambda points: points * [-1.0, 1.0],
    "turned": lambda points: np.column_stack([-points[:, 1], points[:, 0]]),
}


@pytest.mark.parametrize("mapped", MAPS.values(), ids=MAPS)
@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("field", ["margin", "guarantee"])
def test_a_game_is_the_same_in_a_mirror_and_turned(policy, field, mapped):
    pursuers, evaders = [[0.71, 0.72], [3.13, 0.94]], [[1.93, 1.13], [3.31, 2.16]]
    run = run_tracking(make_game(policy, pursuers, evaders, field=field))
    other = run_tracking(make_game(policy, pursuers, evaders, field=field, mapped=mapped))
    assert other.tracking_time == pytest.approx(run.tracking_time, abs=1e-6)
    assert other.lost_evader == run.lost_evader
    for name in ("pursuer_position", "evader_position"):
        there = mapped(run.log[name].reshape(-1, 2)).reshape(run.log[name].shape)
        # Long games grow apart from rounding.
        np.testing.assert_allclose(other.log[name][:100], there[:100], atol=1e-6)


@pytest.mark.parametrize("policy", POLICIES)
def test_a_game_goes_on_from_a_copy_of_its_context_as_it_would_have_gone_on(policy):
    diagram = MakeTracking(make_game(policy, [[0.7, 0.7]], [[1.9, 1.13]], field="margin"))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(3.1)
    copy = simulator.get_context().Clone()
    futures = []
    for context in (simulator.get_context(), copy):
        resumed = simulator if context is simulator.get_context() else Simulator(diagram, context)
        resumed.AdvanceTo(8.0)
        names = ("pursuer_position", "evader_position", "evader_velocity", "loss")
        futures.append(np.concatenate([diagram.GetOutputPort(n).Eval(context) for n in names]))
    np.testing.assert_array_equal(*futures)


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("model", ["point", "differential_drive"])
def test_robots_with_bodies_play_without_touching(policy, model):
    body = {"radius": 0.12, "model": model}
    pursuers, evaders = [[0.7, 0.7], [3.3, 0.9]], [[1.9, 1.1], [3.4, 2.1]]
    game = make_game(policy, pursuers, evaders, evading=body, field="guarantee", **body)
    run = run_tracking(replace(game, scenario=replace(game.scenario, seconds=8.0)))
    robots = np.concatenate([run.log["pursuer_position"], run.log["evader_position"]], axis=1)
    for i in range(4):
        for j in range(i):
            apart = np.hypot(*(robots[:, i] - robots[:, j]).T)
            assert apart.min() > 0.24
    # Evaders do run.
    speed = np.hypot(*np.moveaxis(run.log["evader_velocity"], -1, 0))
    assert math.isclose(np.median(speed), 0.09, rel_tol=0.05)

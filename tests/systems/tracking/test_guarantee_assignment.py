"""Pursuers are matched by what the solved game guarantees, and hold on to it."""

from itertools import permutations

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.bottleneck import promised_steps
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.pursuit import time_of_team
from sightfield.systems.tracking import GuaranteeAssignment, LineOfSight

WORLD = make_world(
    [[0, 0], [3, 0], [3, 3], [0, 3]], [[[1.03, 0.98], [1.96, 0.98], [1.96, 2.11], [1.03, 2.11]]]
)
TABLE = solve_visibility_game(WORLD, pursuer_speed=0.3, evader_speed=0.09, grid=0.2)
SIZES = {"pursuers": 2, "evaders": 2}


def draw(rng):
    """A free place off the nodes."""
    while True:
        point = rng.uniform(0.1, 2.9, 2)
        if not (0.9 < point[0] < 2.1 and 0.85 < point[1] < 2.25):
            return point


def teams(seed):
    """Positions of both teams, shape (4,) each, in which all pairs see each other or not."""
    rng = np.random.default_rng(seed)
    return tuple(np.concatenate([draw(rng), draw(rng)]) for _ in range(2))


def assigned(system, context, pursuers, evaders):
    """The assignment of a moment."""
    sight = LineOfSight(WORLD, **SIZES)
    eyes = sight.CreateDefaultContext()
    for target, at in ((sight, eyes), (system, context)):
        target.GetInputPort("pursuer_position").FixValue(at, pursuers)
        target.GetInputPort("evader_position").FixValue(at, evaders)
    system.GetInputPort("sight").FixValue(context, sight.GetOutputPort("sight").Eval(eyes))
    return system.GetOutputPort("assignment").Eval(context).astype(int)


def least_time(targets, pursuers, evaders):
    """What the table guarantees for a matching, looked up pair by pair [s]."""
    pairs = enumerate(targets)
    return min(
        TABLE.time(pursuers[2 * i : 2 * i + 2], evaders[2 * j : 2 * j + 2]) for i, j in pairs
    )


def test_no_other_matching_guarantees_more():
    system = GuaranteeAssignment(TABLE, WORLD, **SIZES)
    context = system.CreateDefaultContext()
    matched, decided = 0, 0
    for seed in range(60):
        pursuers, evaders = teams(seed)
        targets = assigned(system, context, pursuers, evaders)
        if sorted(targets) != [0, 1]:
            continue
        matched += 1
        times = [least_time(each, pursuers, evaders) for each in permutations(range(2))]
        # The table's own positions are nodes, a step apart at most.
        assert least_time(targets, pursuers, evaders) >= max(times) - 1e-9
        decided += times[0] != times[1]
    assert matched > 20
    assert decided > 5


def test_a_matching_is_left_when_more_can_be_guaranteed():
    system = GuaranteeAssignment(TABLE, WORLD, **SIZES, hold="certificate", period=0.1)
    context, board = system.CreateDefaultContext(), make_board(TABLE)
    changes, kept = 0, 0
    for seed in range(200):
        pursuers, evaders = teams(seed)
        held = np.array([0, 1] if seed % 2 else [1, 0])
        context.SetDiscreteState(held.astype(float))
        targets = assigned(system, context, pursuers, evaders)
        seen = system.GetInputPort("sight").Eval(context)[:4].reshape(2, 2) > 0.5
        game = board, pursuers, evaders, seen
        times = [TABLE.step * time_of_team(*game, each) for each in (held, held[::-1])]
        enough = 1.1 * times[0] + TABLE.step
        if (targets == held).all():
            # Nor is there one with which a pursuer does not see its own.
            assert not (seen[[0, 1], held[::-1]].all() and times[1] > enough)
            kept += 1
        else:
            assert TABLE.step * time_of_team(*game, targets) > enough
            changes += 1
    assert 0 < changes < kept


def test_what_is_promised_comes_first():
    lower = solve_visibility_game(
        WORLD, pursuer_speed=0.3, evader_speed=0.09, grid=0.2, bound="lower"
    )
    system = GuaranteeAssignment(TABLE, WORLD, **SIZES, promised=lower)
    plain = GuaranteeAssignment(TABLE, WORLD, **SIZES)
    board, differ = make_board(lower), 0
    for seed in range(600):
        pursuers, evaders = teams(seed)
        found = assigned(system, system.CreateDefaultContext(), pursuers, evaders)
        other = assigned(plain, plain.CreateDefaultContext(), pursuers, evaders)
        if sorted(found) != [0, 1] or sorted(other) != [0, 1]:
            continue
        steps = promised_steps(board, pursuers, evaders, np.ones((2, 2), dtype=bool))
        least = [steps[[0, 1], targets].min() for targets in (found, other)]
        assert least[0] >= least[1]
        differ += least[0] > least[1]
        # Where nothing is promised for any of them, the middle bound decides as it does alone.
        if not steps.any():
            assert (found == other).all()
    assert differ > 0


def test_what_is_held_is_in_the_context():
    system = GuaranteeAssignment(TABLE, WORLD, **SIZES, hold="until_lost", period=0.1)
    context = system.CreateDefaultContext()
    pursuers, evaders = np.array([0.5, 0.3, 0.5, 0.7]), np.array([0.9, 0.3, 0.9, 0.7])
    first = assigned(system, context, pursuers, evaders)
    other = first[::-1].copy()
    context.SetDiscreteState(other.astype(float))
    assert assigned(system, context, pursuers, evaders).tolist() == other.tolist()
    assert assigned(system, context.Clone(), pursuers, evaders).tolist() == other.tolist()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hold": "cost"}, "`hold` must be one of none, until_lost, certificate; got cost"),
        ({"promised": TABLE}, "`promised` must be by the lower bound; got middle"),
        ({"hold": "certificate"}, "`period` must be positive to hold certificate"),
    ],
)
def test_nonsense_is_refused(options, message):
    with pytest.raises(InvalidInput, match=message):
        GuaranteeAssignment(TABLE, WORLD, **SIZES, **options)

"""Whom each pursuer watches, by the solved visibility game."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_non_negative, require_one_of
from ..numerics.geometry.world import World
from ..numerics.tracking.corner_table import corner_table
from ..numerics.tracking.sight_state import sight_size
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.bottleneck import (
    SWITCHES,
    bottleneck,
    certificate,
    covered,
    is_longer,
    with_helpers,
)
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ..numerics.tracking.visibility_game.pursuit import pair_worths
from ..numerics.tracking.visibility_game.regain import steps_to_guard
from .assignment import NOTHING_HELD


class GuaranteeAssignment(LeafSystem):
    """Matches pursuers with evaders so that the least of the guaranteed times is greatest.

    If each pursuer plays the game of one against one with its own evader, all evaders stay in
    sight for as long as that, whatever they do. What is held is discrete state, sampled with the
    period; it is left when another matching has more evaders in the sight of their own pursuers,
    or guarantees more by a tenth and a step of the game. An evader that no pursuer can be spared
    for is given to one that does not see it and could guard it soonest.

    .. pydrake_system::

        name: GuaranteeAssignment
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        output_ports:
        - assignment

    ================  ===================  ====  =====
    port              size                 unit  frame
    ================  ===================  ====  =====
    pursuer_position  2 Np                 m     world
    evader_position   2 Ne                 m     world
    sight             Np Ne + Np K + Ne K  -     -
    assignment        Np                   -     -
    ================  ===================  ====  =====

    Source: ours; see `numerics.tracking.visibility_game.bottleneck`.

    Args:
        table: The game of one pursuer and one evader.
        world: Whose corners the sight port tells of.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        hold: When to change: a name in SWITCHES.
        period: Sampling period of what is held; without one nothing is held [s].

    Raises:
        InvalidInput: A name is unknown or a number out of its range; the table is too large.
    """

    def __init__(
        self,
        table: GuaranteedTimes,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        hold: str = "none",
        period: float = 0.0,
    ):
        super().__init__()
        require_one_of("hold", hold, SWITCHES)
        require_non_negative("period", period)
        require(hold == "none" or period > 0, "period", f"be positive to hold {hold}", period)
        self._board, self._step, self._hold = make_board(table), table.step, hold
        self._shape = (pursuers, evaders)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        size = sight_size(pursuers, evaders, len(corner_table(world)))
        self._sight = self.DeclareVectorInputPort("sight", size)
        self._chosen = self.DeclareVectorOutputPort("assignment", pursuers, self._calc_assignment)
        if hold != "none":
            self._held = self.DeclareDiscreteState(state_vector(np.full(pursuers, NOTHING_HELD)))
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)

    def _calc_assignment(self, context, output):
        sight, held = read(self._sight, context), self._what_is_held(context)
        n, m = self._shape
        visible = sight[: n * m].reshape(n, m) > 0.5
        if held is not None and self._hold == "until_lost" and covered(held, visible) == m:
            output.set_value(held)
            return
        pursuers, evaders = read(self._pursuers, context), read(self._evaders, context)
        steps, worth = pair_worths(self._board, pursuers, evaders, visible)
        time = 0.0 if held is None else certificate(held, steps)
        if np.isinf(time):
            output.set_value(held)
            return
        chosen = bottleneck(worth)
        if held is not None and not self._is_better(chosen, held, visible, steps):
            chosen = held
        else:
            hidden = np.zeros_like(visible) if covered(chosen, visible) == n else ~visible
            soonest = steps_to_guard(self._board, pursuers, evaders, hidden)
            chosen = with_helpers(chosen, worth, soonest)
        output.set_value(chosen)

    def _is_better(self, chosen, held, visible, steps):
        """Whether to leave what is held: for more evaders in sight, or a longer certificate."""
        more = covered(chosen, visible) - covered(held, visible)
        if more != 0 or self._hold == "until_lost":
            return more > 0
        times = [self._step * certificate(each, steps) for each in (chosen, held)]
        return is_longer(*times, step=self._step)

    def _what_is_held(self, context):
        if self._hold == "none":
            return None
        held = context.get_discrete_state(self._held).value()
        return None if held[0] == NOTHING_HELD else held.astype(int)

    def _keep(self, context, discrete_state):
        discrete_state.set_value(self._held, self._chosen.Eval(context))

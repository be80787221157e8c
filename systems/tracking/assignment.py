"""Which evader each pursuer goes after."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_non_negative, require_one_of
from ..numerics.geometry.world import World
from ..numerics.tracking.assignment.holding import HOLDS, hold_or_choose, is_broken
from ..numerics.tracking.assignment.rules import (
    ASSIGNMENT_RULES,
    AssignmentRule,
    checked,
    decentralised,
)
from ..numerics.tracking.assignment.team_view import EXTRA_PURSUERS, TeamView
from ..numerics.tracking.risk import RISK_FUNCTIONS, team_risk
from .game_ports import GamePorts, codes_of

# State of an assignment before the first sample.
NOTHING_HELD = -2.0


class Assignment(LeafSystem):
    """Gives each pursuer an evader that it sees, or none (-1), by a rule on the team's risks.

    The rule says which assignment the team would choose, `hold` when it follows the rule: at every
    step ("none", as in the thesis); when a pursuer has lost its evader, or a spare pursuer sees an
    evader that nobody has ("until_lost"); or also when that changes the total risk by a quarter
    ("cost"). The held assignment is discrete state, sampled with the period.

    With a finite `radio_range` there is no centre: each pursuer applies the rule to what it sees
    itself and what the pursuers within that range report, and keeps its own part of the result.

    .. pydrake_system::

        name: Assignment
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        output_ports:
        - assignment

    ================  ===================  ====  =====  ===========
    port              size                 unit  frame  feedthrough
    ================  ===================  ====  =====  ===========
    pursuer_position  2 Np                 m     world  -
    evader_position   2 Ne                 m     world  -
    sight             Np Ne + Np K + Ne K  -     -      -
    assignment        Np                   -     -      all
    ================  ===================  ====  =====  ===========

    Source: Zhang 2014, 2.2.3.2, (2.3), (2.13), Algorithm 1; radio range: ours.

    Args:
        world: Whose corners the risks refer to.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        hold: When to follow the rule, a name in `HOLDS`.
        period: Sampling period of the held assignment; 0 only if nothing is held [s].
        rule: A name in `ASSIGNMENT_RULES`, or a function of a TeamView.
        risk_functions: Names in `RISK_FUNCTIONS`, one for all pursuers or one each.
        extra: What pursuers beyond a matching do: "stay" or "riskiest".
        seed: For rules that draw lots.
        radio_range: How far pursuers hear each other [m].

    Raises:
        InvalidInput: A name is unknown, the number of risk functions is wrong, or the range is
            negative; at run time, a rule does not return an evader or -1 for each pursuer.
    """

    def __init__(
        self,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        rule: str | AssignmentRule = "hungarian",
        hold: str = "none",
        period: float = 0.0,
        risk_functions: Sequence[str] = ("total",),
        extra: str = "stay",
        seed: int = 0,
        radio_range: float = math.inf,
    ):
        super().__init__()
        if isinstance(rule, str):
            require_one_of("rule", rule, ASSIGNMENT_RULES)
            rule = ASSIGNMENT_RULES[rule]
        require_one_of("hold", hold, HOLDS)
        require_non_negative("period", period)
        require(hold == "none" or period > 0, "period", f"be positive to hold {hold}", period)
        require_one_of("extra", extra, EXTRA_PURSUERS)
        require(radio_range >= 0, "radio_range", "be zero or positive", radio_range)
        self._hold = hold
        # The answer is checked before any conversion, which would turn 0.5 into 0.
        self._rule = decentralised(checked(rule), radio_range)
        self._kinds = codes_of("risk_functions", risk_functions, RISK_FUNCTIONS, pursuers)
        self._extra, self._seed = extra, seed
        self._game = GamePorts(self, world, pursuers, evaders)
        # Stored, because finding the port by name takes as long as a small matching.
        self._chosen = self.DeclareVectorOutputPort("assignment", pursuers, self._calc_assignment)
        if hold != "none":
            self._held = self.DeclareDiscreteState(state_vector(np.full(pursuers, NOTHING_HELD)))
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)

    def _calc_assignment(self, context, output):
        game, held = self._game, self._what_is_held(context)
        (n, m), visible = game.shape, game.visible(context)
        if self._hold == "until_lost" and held is not None and not is_broken(visible, held):
            # The same result as that of `hold_or_choose`, without computing risks.
            output.set_value(held)
            return
        pursuers, evaders = game.positions(context)
        view = TeamView(
            visible=visible,
            risk=team_risk(self._kinds, evaders, read(game.sight, context), game.corners),
            pursuers=pursuers.reshape(n, 2),
            evaders=evaders.reshape(m, 2),
            extra=self._extra,
            seed=self._seed,
        )
        targets = hold_or_choose(view, held, self._rule, self._hold)
        output.set_value(targets)

    def _what_is_held(self, context):
        if self._hold == "none":
            return None
        held = context.get_discrete_state(self._held).value()
        return None if held[0] == NOTHING_HELD else held.astype(int)

    def _keep(self, context, discrete_state):
        discrete_state.set_value(self._held, self._chosen.Eval(context))

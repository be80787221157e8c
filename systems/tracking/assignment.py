"""Which evader each pursuer goes after: by a rule, or by the solved visibility game."""

import math
from collections.abc import Callable, Collection, Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import read, state_vector
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
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.bottleneck import (
    SWITCHES,
    bottleneck,
    certificate,
    covered,
    is_longer,
    promised_steps,
    with_helpers,
)
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ..numerics.tracking.visibility_game.planes import FOR_EVER
from ..numerics.tracking.visibility_game.pursuit import pair_worths, time_of_team
from ..numerics.tracking.visibility_game.regain import steps_to_guard
from .game_ports import GamePorts, codes_of

# State of an assignment before the first sample.
NOTHING_HELD = -2.0


def _require_hold(hold: str, period: float, known: Collection[str]) -> None:
    """Refuse a way of holding that is unknown, or one that is never looked at."""
    require_one_of("hold", hold, known)
    require_non_negative("period", period)
    require(hold == "none" or period > 0, "period", f"be positive to hold {hold}", period)


class _Held:
    """The assignment that a system puts out, and holds as discrete state, sampled with a period."""

    def __init__(
        self, system: LeafSystem, pursuers: int, calc: Callable, hold: str, period: float
    ) -> None:
        # Stored, because finding the port by name takes as long as a small matching.
        self._chosen = system.DeclareVectorOutputPort("assignment", pursuers, calc)
        self._state = None
        if hold != "none":
            nothing = state_vector(np.full(pursuers, NOTHING_HELD))
            self._state = system.DeclareDiscreteState(nothing)
            system.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)

    def targets(self, context):
        """What is held, shape (Np,); None before the first sample, or if nothing ever is."""
        if self._state is None:
            return None
        held = context.get_discrete_state(self._state).value()
        return None if held[0] == NOTHING_HELD else held.astype(int)

    def _keep(self, context, discrete_state):
        discrete_state.set_value(self._state, self._chosen.Eval(context))


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
        _require_hold(hold, period, HOLDS)
        require_one_of("extra", extra, EXTRA_PURSUERS)
        require(radio_range >= 0, "radio_range", "be zero or positive", radio_range)
        self._hold = hold
        # The answer is checked before any conversion, which would turn 0.5 into 0.
        self._rule = decentralised(checked(rule), radio_range)
        self._kinds = codes_of("risk_functions", risk_functions, RISK_FUNCTIONS, pursuers)
        self._extra, self._seed = extra, seed
        self._game = GamePorts(self, world, pursuers, evaders)
        self._held = _Held(self, pursuers, self._calc_assignment, hold, period)

    def _calc_assignment(self, context, output):
        game, held = self._game, self._held.targets(context)
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


# Weight of a promised step: it counts more than any value of a pair by the middle bound.
PROMISED = 1e6


class GuaranteeAssignment(LeafSystem):
    """Matches pursuers with evaders so that the least of the guaranteed times is greatest.

    If each pursuer plays the one-against-one game with its own evader, all evaders stay in sight
    for that time, whatever they do. `hold` says when the matching changes: at every step ("none");
    when another one keeps more evaders in sight ("until_lost"); or when one guarantees a time
    longer by a tenth and a step of the game ("certificate"). Except with "none" it is discrete
    state, sampled with the period. For an evader that its own pursuer does not see, the time counts
    for which a teammate can mind it.
    Pursuers left over help, first with evaders that nobody watches; one that none of them sees goes
    to the pursuer that could guard it soonest.

    .. pydrake_system::

        name: GuaranteeAssignment
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

    Source: ours; see `numerics.tracking.visibility_game.bottleneck`.

    Args:
        table: The game of one pursuer and one evader.
        world: Whose corners the sight port refers to.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        hold: When to change: a name in SWITCHES.
        period: Sampling period of the held matching; 0 only if nothing is held [s].
        promised: The game by the lower bound, if pursuers play by it: then promised times are
            compared first, and `table` ranks pairs with equal or no promises.

    Raises:
        InvalidInput: A name is unknown or a number out of its range; the table is too large, or
            `promised` is not by the lower bound.
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
        promised: GuaranteedTimes | None = None,
    ):
        super().__init__()
        _require_hold(hold, period, SWITCHES)
        self._board, self._hold = make_board(table), hold
        self._promising = None if promised is None else make_board(promised)
        self._steps = [each.step for each in (promised, table) if each is not None]
        if promised is not None:
            require(promised.bound == "lower", "promised", "be by the lower bound", promised.bound)
        self._game = GamePorts(self, world, pursuers, evaders)
        self._held = _Held(self, pursuers, self._calc_assignment, hold, period)

    def _calc_assignment(self, context, output):
        held, visible = self._held.targets(context), self._game.visible(context)
        n, m = self._game.shape
        if held is not None and self._hold == "until_lost" and covered(held, visible) == m:
            output.set_value(held)
            return
        pursuers, evaders = self._game.positions(context)
        game = pursuers, evaders, visible
        lasts = self._guarantees(game)
        before = (0.0,) if held is None else lasts(held)
        if np.isinf(before[0]):
            output.set_value(held)
            return
        worth = self._worths(game)
        chosen = bottleneck(worth)
        if held is not None and not self._is_better(chosen, held, visible, lasts, before):
            chosen = held
        else:
            hidden = np.zeros_like(visible) if covered(chosen, visible) == n else ~visible
            soonest = steps_to_guard(self._board, pursuers, evaders, hidden)
            chosen = with_helpers(chosen, worth, soonest)
        output.set_value(chosen)

    def _guarantees(self, game):
        """Make a function that gives how long a matching keeps all evaders; of two answers the
        more certain one comes first [s]."""
        if self._promising is None:
            step, (pursuers, evaders, seen) = self._steps[0], game
            return lambda targets: (
                step * time_of_team(self._board, pursuers, evaders, seen, targets),
            )
        tables = (
            promised_steps(self._promising, *game),
            pair_worths(self._board, *game)[0],
        )
        times = [step * steps for step, steps in zip(self._steps, tables, strict=True)]
        return lambda targets: tuple(certificate(targets, each) for each in times)

    def _worths(self, game):
        """What each pair is worth, shape (Np, Ne)."""
        worth = pair_worths(self._board, *game)[1]
        if self._promising is None:
            return worth
        return worth + PROMISED * np.minimum(promised_steps(self._promising, *game), FOR_EVER)

    def _is_better(self, chosen, held, visible, lasts, before):
        """Whether to change the held matching: for more evaders in sight, or a longer guarantee."""
        if self._hold == "until_lost":
            return covered(chosen, visible) > covered(held, visible)
        times = zip(lasts(chosen), before, self._steps, strict=True)
        # The first times that differ decide.
        return next((is_longer(*each) for each in times if each[0] != each[1]), False)

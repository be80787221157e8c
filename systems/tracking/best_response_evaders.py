"""Evaders that choose the best response to the pursuers' rule."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import read, state_vector
from ..numerics.errors import require, require_non_negative, require_one_of, require_positive
from ..numerics.geometry.edge_index import build_edge_index, index_regions
from ..numerics.geometry.segment_sight import build_corner_index
from ..numerics.geometry.wall_sliding import SKIN
from ..numerics.geometry.world import World
from ..numerics.tracking.adversarial_evasion import adversarial_velocities
from ..numerics.tracking.assignment.holding import HOLDS
from ..numerics.tracking.assignment.matching import MOST_EVADERS
from ..numerics.tracking.assignment.team_view import EXTRA_PURSUERS
from ..numerics.tracking.best_response.rollouts import (
    BY_THE_GAME,
    FIXED,
    GREATEST_RISK,
    LEAST_RISK,
    LOOKAHEAD_PURSUIT,
    GameRules,
    Rollout,
    choose_plan,
    follow_plan,
)
from ..numerics.tracking.corner_policies import FIELDS
from ..numerics.tracking.risk import RISK_FUNCTIONS, RISK_VECTORS
from ..numerics.tracking.visibility_game.board import make_board
from ..numerics.tracking.visibility_game.bottleneck import SWITCHES
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ..numerics.tracking.visibility_game.responsibilities import make_team_board
from ..numerics.tracking.visibility_game.two_evaders import GuaranteedTimesOfTwo
from .game_ports import GamePorts, codes_of


class Foresight(NamedTuple):
    """How plans are simulated, and how often.

    Attributes:
        rollout: How far ahead and how finely plans are simulated.
        decision_period: Time between decisions [s].
        beyond: A second rollout, used after `patience` if no plan breaks sight in the first.
        patience: Time from the first decision until `beyond` is used [s].
    """

    rollout: Rollout
    decision_period: float
    beyond: Rollout | None = None
    patience: float = 0.0


# The best of several settings of equal cost, see BENCHMARKS.md. Games of one evader are long. In
# games of several evaders, some evader soon gets away; otherwise they have to look farther ahead.
ALONE = Foresight(Rollout(horizon=20.0, step=0.25, headings=12), 0.7)
IN_TEAMS = Foresight(
    Rollout(horizon=8.0, step=0.1, headings=32),
    1.5,
    beyond=Rollout(horizon=20.0, step=0.4, headings=12),
    patience=12.0,
)

# Pursuits by name, with the code of the one that the evaders assume.
KNOWN_PURSUITS = {
    **FIELDS,
    "lookahead": LOOKAHEAD_PURSUIT,
    **dict.fromkeys(("guarantee", "certified"), FIELDS["margin"]),
}
# Names of holds that are accepted; all except "none" are taken for "until_lost".
KNOWN_HOLDS = tuple(dict.fromkeys((*HOLDS, *SWITCHES)))
_MATCHINGS = {"hungarian": LEAST_RISK, "hungarian_max": GREATEST_RISK}


class BestResponseEvaders(LeafSystem):
    """Each evader simulates its plans against the pursuers' rule, and takes the best.

    At every decision each evader tries straight runs in all directions, runs to the corners that
    it sees, and the corner game's best play, each against the pursuers' own rule. In between it
    follows its plan. An evader that nobody sees waits.

    .. pydrake_system::

        name: BestResponseEvaders
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        - assignment
        output_ports:
        - velocity

    ================  ===================  ====  =====  ===========
    port              size                 unit  frame  feedthrough
    ================  ===================  ====  =====  ===========
    pursuer_position  2 Np                 m     world  -
    evader_position   2 Ne                 m     world  -
    sight             Np Ne + Np K + Ne K  -     -      -
    assignment        Np                   -     -      -
    velocity          2 Ne                 m/s   world  all
    ================  ===================  ====  =====  ===========

    If pursuers share the evaders out, there is also an input port `responsible` (Ne), the pursuer
    responsible for each evader, as from `TeamGuaranteePursuit`.

    Plans are discrete state: the kind of each evader's plan, and its direction or place.

    Source: ours; see `numerics.tracking.best_response.rollouts`.

    Args:
        world: Whose corners hide.
        pursuer_regions, evader_regions: Where the centres may be, from `shrink_world`.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        pursuer_speed, evader_speed: Top speeds [m/s].
        pursuit: The pursuers' rule, a name in `KNOWN_PURSUITS`.
        risk_vectors: Of the pursuers, names in `RISK_VECTORS`, one for all or one each.
        assignment: Their assignment rule. "hungarian" and "hungarian_max" are simulated; with other
            rules, or more than MOST_EVADERS evaders, the present assignment is assumed to stay.
        hold: When they follow it, a name in `KNOWN_HOLDS`; all but "none" are taken for
            "until_lost".
        extra: What pursuers beyond a matching do: "stay" or "riskiest".
        risk_functions: Of the pursuers, names in `RISK_FUNCTIONS`, one for all or one each.
        radius: Of an evader: least distance of its centre from a wall [m].
        foresight: How plans are simulated; None: ALONE for one evader, IN_TEAMS for more.
        table: The visibility game by which pursuers play with the rule "guarantee", or, by the
            lower bound, "certified"; without it they are assumed to follow the margin field.
        double: The game of two evaders, if pursuers share the evaders out by it; then `responsible`
            is an input port.

    Raises:
        InvalidInput: A name is unknown, or a number out of its range; the table is not by the bound
            that the pursuers use, or too large.
    """

    def __init__(
        self,
        world: World,
        pursuer_regions: Sequence[World],
        evader_regions: Sequence[World],
        *,
        pursuers: int,
        evaders: int,
        pursuer_speed: float,
        evader_speed: float,
        pursuit: str = "margin",
        risk_vectors: Sequence[str] = ("proportional",),
        assignment: str = "hungarian",
        hold: str = "until_lost",
        extra: str = "stay",
        risk_functions: Sequence[str] = ("total",),
        radius: float = 0.0,
        foresight: Foresight | None = None,
        table: GuaranteedTimes | None = None,
        double: GuaranteedTimesOfTwo | None = None,
    ):
        super().__init__()
        require_one_of("pursuit", pursuit, KNOWN_PURSUITS)
        require_positive("pursuer_speed", pursuer_speed)
        require_positive("evader_speed", evader_speed)
        slower = evader_speed < pursuer_speed
        require(slower, "evader_speed", f"be below {pursuer_speed}", evader_speed)
        require_non_negative("radius", radius)
        require_one_of("hold", hold, KNOWN_HOLDS)
        require_one_of("extra", extra, EXTRA_PURSUERS)
        if foresight is None:
            foresight = ALONE if evaders == 1 else IN_TEAMS
        self._rollout, self._beyond = _checked(foresight.rollout), None
        if foresight.beyond is not None:
            self._beyond = _checked(foresight.beyond)
        self._patience, period = float(foresight.patience), foresight.decision_period
        require_positive("decision_period", period)
        commitment = 0.0
        if table is not None and pursuit == "certified":
            require(table.bound == "lower", "table", "be by the lower bound", table.bound)
            commitment = float(table.step)
        self._game = GamePorts(self, world, pursuers, evaders, assigned=True)
        index = build_edge_index(world)
        self._rules = GameRules(
            world=index,
            corner_index=build_corner_index(world, index),
            corners=self._game.corners,
            pursuer_region=index_regions("pursuer_regions", pursuer_regions),
            evader_region=index_regions("evader_regions", evader_regions),
            field=KNOWN_PURSUITS[pursuit],
            weightings=codes_of("risk_vectors", risk_vectors, RISK_VECTORS, pursuers),
            matching=_MATCHINGS.get(assignment, FIXED) if evaders <= MOST_EVADERS else FIXED,
            held=hold != "none",
            riskiest=extra == "riskiest",
            risk_kinds=codes_of("risk_functions", risk_functions, RISK_FUNCTIONS, pursuers),
            ratio=float(evader_speed / pursuer_speed),
            pursuer_speed=float(pursuer_speed),
            evader_speed=float(evader_speed),
            # Wall sliding stops a skin short of the wall; a little more is "at the wall".
            standoff=float(radius) + 10.0 * SKIN * world.tolerance,
            commitment=commitment,
        )
        self._board = self._team = None
        if table is not None and pursuit in ("guarantee", "certified"):
            if double is None:
                self._board = make_board(table)
            else:
                self._team = make_team_board(table, double)
        if self._team is not None:
            self._responsible = self.DeclareVectorInputPort("responsible", evaders)
        plans = np.zeros((evaders, 3))
        self._plans = self.DeclareDiscreteState(state_vector(plans.ravel()))
        # Time of the first decision, -1 before it: a resumed run does not decide again at once.
        self._begun = self.DeclareDiscreteState(state_vector(np.array([-1.0])))
        self.DeclareInitializationDiscreteUpdateEvent(self._begin)
        self.DeclarePeriodicDiscreteUpdateEvent(period, period, self._decide)
        self.DeclareVectorOutputPort("velocity", 2 * evaders, self._calc_velocity)

    def _begin(self, context, discrete_state):
        if context.get_discrete_state(self._begun).value()[0] < 0.0:
            self._decide(context, discrete_state)
            discrete_state.set_value(self._begun, [context.get_time()])

    def _decide(self, context, discrete_state):
        plans = context.get_discrete_state(self._plans).value().reshape(-1, 3).copy()
        pursuers, evaders = self._game.positions(context)
        assignment = self._game.targets(context).astype(int)
        responsible = None
        if self._team is not None:
            responsible = read(self._responsible, context).astype(int)
        velocities = self._velocities(context, plans)
        game = pursuers, evaders, velocities, assignment
        boards = self._board, self._team, responsible
        beyond = self._beyond if self._is_long(context) else None
        for j in range(len(plans)):
            plans[j], takes = choose_plan(self._rules, self._rollout, j, *game, plans[j], *boards)
            if beyond is not None and takes > self._rollout.horizon:
                plans[j], _ = choose_plan(self._rules, beyond, j, *game, plans[j], *boards)
        discrete_state.set_value(self._plans, plans.ravel())

    def _is_long(self, context) -> bool:
        """Whether the game has lasted for longer than the evaders' patience."""
        begun = context.get_discrete_state(self._begun).value()[0]
        return begun >= 0.0 and context.get_time() - begun >= self._patience

    def _calc_velocity(self, context, output):
        plans = context.get_discrete_state(self._plans).value().reshape(-1, 3)
        output.set_value(self._velocities(context, plans))

    def _velocities(self, context, plans):
        """Velocities along plans, shape (2 Ne,) [m/s]."""
        rules, (pursuers, evaders) = self._rules, self._game.positions(context)
        velocities = adversarial_velocities(
            pursuers,
            evaders,
            read(self._game.sight, context),
            rules.corners,
            rules.ratio,
            rules.evader_speed,
            rules.standoff,
        )
        seen = np.any(self._game.visible(context), axis=0)
        for j, (kind, ax, ay) in enumerate(plans):
            if kind != BY_THE_GAME and seen[j]:
                x, y = evaders[2 * j], evaders[2 * j + 1]
                velocities[2 * j : 2 * j + 2] = follow_plan(
                    kind, ax, ay, x, y, rules.evader_speed, self._rollout.step
                )
        return velocities


def _checked(rollout: Rollout) -> Rollout:
    """Check a rollout, and convert it to types that compiled functions accept."""
    require_positive("rollout.horizon", rollout.horizon)
    require_positive("rollout.step", rollout.step)
    require(rollout.headings >= 0, "rollout.headings", "be 0 or positive", rollout.headings)
    horizon, step, headings, leg = rollout
    return Rollout(float(horizon), float(step), int(headings), float(leg))

"""Certified pursuers: they keep what the lower bound guarantees, by its own policy."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import read, state_vector
from ..numerics.errors import InvalidInput, require, require_positive
from ..numerics.geometry.world import World
from ..numerics.tracking.collision_stop import gap_to_paths, gap_to_runners
from ..numerics.tracking.visibility_game.bounds import team_certificate
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from .collision_avoidance import body_radii
from .game_ports import FieldRule, GamePorts

# A pursuer's commitment: its destination, the number of periods left, its evader, how long that is
# kept in sight after these periods, and the starting point.
COMMITMENT = 7
X, Y, LEFT, EVADER, PROMISE, FROM_X, FROM_Y = range(COMMITMENT)

# Deviation from its way beyond which a pursuer is off course, in parts of the distance that it goes
# in a step: above rounding.
OFF_COURSE = 1e-5

# Gap to keep, when ways are chosen, to teammates on their ways and to standing evaders, in parts of
# the distance at which bodies touch.
ROOM = 0.05

NOTHING = [0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0]


class CertifiedPursuit(LeafSystem):
    """Each pursuer commits itself to a place for one step of the table, and keeps its guarantee.

    At the beginning of a step it chooses the place with which the lower bound guarantees the
    longest time, goes straight there, at the speed with which it arrives when the step is over, and
    commits itself again. As long as nothing stops it, its evader stays in sight for at least
    `guaranteed_time`. If it is stopped, or its evader changes, the promise is void, and it commits
    itself anew from its position. Where nothing can be promised it follows the margin field.

    Pursuers with bodies prefer places to which no evader could block the way, nor a teammate on its
    own way. Only if that would shorten their promise do they go where somebody may stop them.

    Differential drives turn in place at the beginning of a step, and drive for the rest of it:
    their table has a turning time.

    .. pydrake_system::

        name: CertifiedPursuit
        input_ports:
        - pursuer_position
        - evader_position
        - sight
        - assignment
        output_ports:
        - velocity
        - guaranteed_time
        - certificate
        - commitment
        - committed

    ================  ===================  =============  =====  =============
    port              size                 unit           frame  feedthrough
    ================  ===================  =============  =====  =============
    pursuer_position  2 Np                 m              world  -
    evader_position   2 Ne                 m              world  -
    sight             Np Ne + Np K + Ne K  -              -      -
    assignment        Np                   -              -      -
    velocity          2 Np                 m/s            world  all
    guaranteed_time   Np                   s              -      all but sight
    certificate       1                    s              -      all but sight
    commitment        7 Np                 see below      world  all but sight
    committed         Np                   -              -      all but sight
    ================  ===================  =============  =====  =============

    `guaranteed_time` is how long each pursuer will keep its evader from now on, infinite if for
    ever, and `certificate` how long the team keeps all evaders. A commitment is a place [m], the
    number of periods left until the pursuer is there, the evader or -1, the time that is guaranteed
    from then on [s], and where the commitment was made [m]. It is discrete state, stored as of the
    end of the present period. `committed` is 1 for each pursuer that has one.

    Source: ours; see `numerics.tracking.visibility_game`.

    Args:
        table: The game of one pursuer and one evader, by the lower bound; a step of it is a whole
            number of periods (`certified_grid`).
        world: Whose corners threaten.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        risk_vectors: Names in `RISK_VECTORS`, one for all pursuers or one each, for the field.
        period: Between commands [s].
        radii, evader_radii: Of the bodies, one for all or one each [m]; 0 for points.

    Raises:
        InvalidInput: The table is not by the lower bound, or its step is not a whole number of
            periods; a name is unknown or a number out of its range; at run time, an assignment
            names no evader.
    """

    def __init__(
        self,
        table: GuaranteedTimes,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        risk_vectors: Sequence[str] = ("proportional",),
        period: float,
        radii: float | Sequence[float] = 0.0,
        evader_radii: float | Sequence[float] = 0.0,
    ):
        super().__init__()
        require(table.bound == "lower", "table", "be by the lower bound", table.bound)
        require_positive("period", period)
        periods = round(table.step / period)
        whole = periods > 0 and abs(table.step - periods * period) <= 1e-6 * period
        require(whole, "period", f"go into the table's step of {table.step:.6g} s", period)
        self._table, self._periods, self._period = table, periods, float(period)
        self._turning = round(table.turning_time / period)
        self._radii = body_radii("radii", radii, pursuers)
        self._evader_radii = body_radii("evader_radii", evader_radii, evaders)
        self._game = GamePorts(self, world, pursuers, evaders, assigned=True)
        self._field = FieldRule(self._game, "margin", risk_vectors, period)
        self._ratio = table.evader_speed / table.pursuer_speed
        nothing = np.tile(NOTHING, pursuers)
        self._kept = self.DeclareDiscreteState(state_vector(nothing))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._go_on)
        self.DeclareVectorOutputPort("velocity", 2 * pursuers, self._calc_velocity)
        # Only the field uses sight, for pursuers that promise nothing.
        promised = {
            self._game.pursuers.ticket(),
            self._game.evaders.ticket(),
            self._game.assignment.ticket(),
            self.discrete_state_ticket(self._kept),
        }
        self.DeclareVectorOutputPort("guaranteed_time", pursuers, self._calc_time, promised)
        self.DeclareVectorOutputPort("certificate", 1, self._calc_certificate, promised)
        self._commitment = self.DeclareVectorOutputPort(
            "commitment", COMMITMENT * pursuers, self._calc_commitment, promised
        )
        self.DeclareVectorOutputPort("committed", pursuers, self._calc_committed, promised)

    def _calc_commitment(self, context, output):
        """The present commitments: the stored ones, renewed where they are over or void."""
        commitments = context.get_discrete_state(self._kept).value().reshape(-1, COMMITMENT).copy()
        pursuers, evaders = (each.reshape(-1, 2) for each in self._game.positions(context))
        assignment = self._game.targets(context)
        void = [
            commitment[LEFT] == 0
            or commitment[EVADER] != evader
            or not self._is_on_course(commitment, p)
            for commitment, p, evader in zip(commitments, pursuers, assignment, strict=True)
        ]
        commitments[void, LEFT] = 0.0
        for i in np.flatnonzero(void):
            commitments[i] = self._commit(
                int(i), pursuers, evaders, int(assignment[i]), commitments
            )
        output.set_value(commitments.ravel())

    def _is_on_course(self, commitment, p):
        """Whether a pursuer is on the straight way of its commitment, and not late."""
        start, end = commitment[[FROM_X, FROM_Y]], commitment[[X, Y]]
        way, rest = end - start, end - p
        length, left = np.hypot(*way), np.hypot(*rest)
        rounding = OFF_COURSE * self._table.pursuer_speed * self._table.step
        due = length * min(commitment[LEFT] / (self._periods - self._turning), 1.0)
        aside = abs(way[0] * rest[1] - way[1] * rest[0])
        return left <= due + rounding and aside <= rounding * length + rounding**2

    def _commit(self, i, pursuers, evaders, evader, commitments):
        """A commitment of pursuer i for a step; 0 periods are left if nothing is guaranteed."""
        if evader < 0:
            return NOTHING
        p = pursuers[i]
        try:
            place, time = self._best_step(i, pursuers, evaders, evader, commitments)
        except InvalidInput:
            # Off the map, for example after being pushed.
            place, time = p, 0.0
        if time == 0.0:
            return [0.0, 0.0, 0.0, float(evader), 0.0, 0.0, 0.0]
        left = time - self._table.step
        return [place[0], place[1], float(self._periods), float(evader), left, p[0], p[1]]

    def _best_step(self, i, pursuers, evaders, evader, commitments):
        """Where pursuer i goes in the next step, and the time that it can then guarantee [s]."""
        p, table = pursuers[i], self._table
        place, time = table.best_step(p, evaders[evader])
        ways = self._ways(i, pursuers, evaders, commitments)
        if time == 0.0 or any(way(place) for way in ways[:1]) or not ways:
            return place, time
        # A detour is fine if it guarantees at least the time promised before.
        kept = commitments[i, EVADER] == evader and commitments[i, PROMISE] > 0.0
        enough = min(time, commitments[i, PROMISE]) if kept else time
        for is_clear in ways:
            other, instead = table.best_step(p, evaders[evader], is_clear)
            if instead >= enough:
                return other, instead
        return place, time

    def _ways(self, i, pursuers, evaders, commitments):
        """Tests of whether the way of pursuer i to a place is clear of robots, strictest first."""
        p, radius, table = pursuers[i], self._radii[i], self._table
        strangers = radius + self._evader_radii
        others = (commitments[:, LEFT] > 0) & (np.arange(len(pursuers)) != i)
        mates = radius + self._radii[others]
        if not (strangers.any() or mates.any()):
            return []
        paths = np.hstack([pursuers[others], commitments[others][:, [X, Y]]])
        seconds = table.turning_time, table.step

        def is_clear(place, contacts, top_speed):
            return (
                gap_to_paths(p, place, paths, (1.0 + ROOM) * mates) >= 0.0
                and gap_to_runners(p, place, seconds, evaders, contacts, top_speed) >= 0.0
            )

        return (
            lambda place: is_clear(place, strangers, table.evader_speed),
            lambda place: is_clear(place, (1.0 + ROOM) * strangers, 0.0),
        )

    def _now(self, context):
        """Commitments, shape (Np, COMMITMENT)."""
        return np.asarray(self._commitment.Eval(context)).reshape(-1, COMMITMENT)

    def _go_on(self, context, discrete_state):
        """Store the commitments at the beginning of a period, with one period less left."""
        commitments = self._now(context).copy()
        commitments[:, LEFT] = np.maximum(commitments[:, LEFT] - 1.0, 0.0)
        discrete_state.set_value(self._kept, commitments.ravel())

    def _calc_velocity(self, context, output):
        pursuers = read(self._game.pursuers, context)
        commitments = self._now(context)
        committed = commitments[:, LEFT] > 0
        velocities = np.zeros((len(commitments), 2))
        if not committed.all():
            assignment = read(self._game.assignment, context)
            speed = self._table.pursuer_speed
            field = self._field.velocities(context, assignment, self._ratio, speed)
            velocities = field.reshape(-1, 2)
        way = commitments[committed, :2] - pursuers.reshape(-1, 2)[committed]
        velocities[committed] = way / (self._period * commitments[committed, LEFT, None])
        output.set_value(velocities.ravel())

    def _calc_committed(self, context, output):
        output.set_value((self._now(context)[:, LEFT] > 0).astype(float))

    def _times(self, context):
        """How long each pursuer keeps its evader, shape (Np,) [s]."""
        commitments = self._now(context)
        ahead = self._period * commitments[:, LEFT]
        return np.where(commitments[:, LEFT] > 0, ahead + commitments[:, PROMISE], 0.0)

    def _calc_time(self, context, output):
        output.set_value(self._times(context))

    def _calc_certificate(self, context, output):
        assignment, evaders = read(self._game.assignment, context), self._game.shape[1]
        output.set_value([team_certificate(self._times(context), assignment, evaders)])

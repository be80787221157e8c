"""For how long a team can keep its evaders in sight, as a signal, and the part that still holds."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import NumericParameters, read, state_vector
from ..numerics.errors import InvalidInput, require_positive
from ..numerics.tracking.visibility_game.bounds import team_certificate
from ..numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from .game_ports import require_assignment


class GuaranteedTime(LeafSystem):
    """Looks up for how long each pursuer can keep its evader, and the team all evaders.

    The table is looked up once per step of the game, and in between the times count down. They are
    what pursuers could achieve by playing as the table does. For what pursuers actually promise,
    see `CertifiedPursuit`.

    .. pydrake_system::

        name: GuaranteedTime
        input_ports:
        - pursuer_position
        - evader_position
        - assignment
        output_ports:
        - guaranteed_time
        - certificate

    ================  ====  ====  =====  ===========
    port              size  unit  frame  feedthrough
    ================  ====  ====  =====  ===========
    pursuer_position  2 Np  m     world  -
    evader_position   2 Ne  m     world  -
    assignment        Np    -     -      -
    guaranteed_time   Np    s     -      all
    certificate       1     s     -      all
    ================  ====  ====  =====  ===========

    Both are infinite where evaders can be kept for ever. The certificate is the shortest time over
    all evaders, 0 if one has no pursuer. The times looked up last, and when that was, are discrete
    state.

    Source: ours; see `numerics.tracking.visibility_game`.

    Args:
        table: The game of one pursuer and one evader.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        period: Between commands; look-ups are made at the beginning of a period [s].

    Raises:
        InvalidInput: The period is not positive; at run time, an assignment names no evader.
    """

    def __init__(self, table: GuaranteedTimes, *, pursuers: int, evaders: int, period: float):
        super().__init__()
        require_positive("period", period)
        self._table, self._evader_count = table, evaders
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        self._assignment = self.DeclareVectorInputPort("assignment", pursuers)
        # The times, and when they were looked up, negative for never.
        self._known = self.DeclareDiscreteState(state_vector(np.append(np.zeros(pursuers), -1.0)))
        every = max(round(table.step / period), 1) * period
        self.DeclarePeriodicDiscreteUpdateEvent(every, 0.0, self._look_up)
        self.DeclareVectorOutputPort("guaranteed_time", pursuers, self._calc_time)
        self.DeclareVectorOutputPort("certificate", 1, self._calc_certificate)

    def _look_up(self, context, discrete_state):
        known = np.append(self._times_now(context), context.get_time())
        discrete_state.set_value(self._known, known)

    def _times_now(self, context):
        """Look up the times in the table, shape (Np,) [s]."""
        pursuers = read(self._pursuers, context).reshape(-1, 2)
        evaders = read(self._evaders, context).reshape(-1, 2)
        assignment = read(self._assignment, context)
        require_assignment(assignment, self._evader_count)
        times = np.zeros(len(pursuers))
        for i, evader in enumerate(assignment):
            if evader >= 0:
                try:
                    times[i] = self._table.time(pursuers[i], evaders[int(evader)])
                except InvalidInput:
                    # Off the map, for example after being pushed.
                    times[i] = 0.0
        return times

    def _times(self, context):
        """The times looked up last, less the time since then, shape (Np,) [s]."""
        *times, since = context.get_discrete_state(self._known).value()
        if since < 0.0:
            return self._times_now(context)
        return np.maximum(np.array(times) - (context.get_time() - since), 0.0)

    def _calc_time(self, context, output):
        output.set_value(self._times(context))

    def _calc_certificate(self, context, output):
        assignment = read(self._assignment, context)
        output.set_value([team_certificate(self._times(context), assignment, self._evader_count)])


# Deflection, in parts of the top speed, up to which a robot does not count as deflected: running
# along walls causes deflections of the order of rounding errors.
ROUNDING = 1e-5


class StandingCertificate(LeafSystem):
    """Withdraws the promise of each pursuer while it is deflected.

    A pursuer's promise holds if it moves as committed. A pursuer whose velocity for the present
    period differs from the one that it asked for promises nothing during that period; at the next
    sample it may commit itself anew from its new position.

    .. pydrake_system::

        name: StandingCertificate
        input_ports:
        - guaranteed_time
        - assignment
        - deflection
        output_ports:
        - certificate
        - withdrawn

    ===============  ====  ====  =====  ===========================
    port             size  unit  frame  feedthrough
    ===============  ====  ====  =====  ===========================
    guaranteed_time  Np    s     -      -
    assignment       Np    -     -      -
    deflection       Np    m/s   -      -
    certificate      1     s     -      all
    withdrawn        Np    -     -      guaranteed_time, deflection
    ===============  ====  ====  =====  ===========================

    `deflection` is by how much the desired velocities are changed, as given by `CollisionAvoidance`
    and `CollisionStop`; the sum, if there are several. `certificate` is how long the team keeps all
    evaders, and `withdrawn` is 1 for each pursuer that has promised something and is deflected.
    Numeric parameters: `top_speed`.

    Source: ours; see `numerics.tracking.visibility_game`.

    Args:
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        top_speed: Of the pursuers [m/s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(self, *, pursuers: int, evaders: int, top_speed: float):
        super().__init__()
        require_positive("top_speed", top_speed)
        self._evader_count = evaders
        self.parameters = NumericParameters(self, top_speed=top_speed)
        self._times = self.DeclareVectorInputPort("guaranteed_time", pursuers)
        self._assignment = self.DeclareVectorInputPort("assignment", pursuers)
        self._deflection = self.DeclareVectorInputPort("deflection", pursuers)
        self.DeclareVectorOutputPort("certificate", 1, self._calc_certificate)
        kept = {
            self._times.ticket(),
            self._deflection.ticket(),
            self.all_parameters_ticket(),
        }
        self.DeclareVectorOutputPort("withdrawn", pursuers, self._calc_withdrawn, kept)

    def _withdrawn(self, context):
        """Which pursuers have promised something and are deflected, shape (Np,)."""
        least = ROUNDING * self.parameters(context).top_speed
        deflected = read(self._deflection, context) > least
        return deflected & (read(self._times, context) > 0.0)

    def _calc_withdrawn(self, context, output):
        output.set_value(self._withdrawn(context).astype(float))

    def _calc_certificate(self, context, output):
        times = np.where(self._withdrawn(context), 0.0, read(self._times, context))
        assignment = read(self._assignment, context)
        output.set_value([team_certificate(times, assignment, self._evader_count)])

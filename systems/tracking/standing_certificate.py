"""What of a team's certificate stands while robots are not always let go where they want."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require_positive
from ..numerics.tracking.visibility_game.certificates import team_certificate

# A robot that is kept from its velocity by less than this part of its top speed is not deflected:
# what walls that it runs along take from it is rounding.
ROUNDING = 1e-5


class StandingCertificate(LeafSystem):
    """Withdraws the promise of each pursuer that is deflected, for as long as it is.

    What a pursuer promises holds if it goes where it says. One whose velocity for the period that
    begins is another than the one that it asked for promises nothing for that moment; at the next
    sample it may commit itself anew from where it then is.

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

    `deflection` is by how much what drives the team changes what was asked of it, as
    `CollisionAvoidance` and `CollisionStop` say; their sum, where there are several. `certificate`
    is how long the team keeps all evaders, and `withdrawn` is 1 for each pursuer that has promised
    something and is deflected. Numeric parameters: `top_speed`.

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
        """Who has promised something and is deflected, shape (Np,)."""
        least = ROUNDING * self.parameters(context).top_speed
        deflected = read(self._deflection, context) > least
        return deflected & (read(self._times, context) > 0.0)

    def _calc_withdrawn(self, context, output):
        output.set_value(self._withdrawn(context).astype(float))

    def _calc_certificate(self, context, output):
        times = np.where(self._withdrawn(context), 0.0, read(self._times, context))
        assignment = read(self._assignment, context)
        output.set_value([team_certificate(times, assignment, self._evader_count)])

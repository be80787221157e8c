"""A controller that keeps the grain cart on a planned path."""

from pydrake.common.containers import namedview
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.planning.path_tracking import make_path_tracker, tracking_control
from ..numerics.planning.plan import TrailerPath
from ..numerics.planning.trailer import Trailer

FollowerState = namedview("FollowerState", ["progress"])


class PathFollower(LeafSystem):
    """Drives a tractor-trailer along a path, and back onto it after a disturbance.

    v = v_r, omega = omega_r + u, progress' = 1 + w, where v_r and omega_r are the path's controls
    at the progress, and (u, w) is a linear-quadratic regulator on the errors in position, theta
    and beta; see `numerics.planning.path_tracking`. At the path's end the cart stands still.

    .. pydrake_system::

        name: PathFollower
        input_ports:
        - state
        output_ports:
        - control
        - progress

    ========  ====  ================  =======  ===========
    port      size  unit              frame    feedthrough
    ========  ====  ================  =======  ===========
    state     4     m, m, rad, rad    world    -
    control   2     m/s, rad/s        tractor  all
    progress  1     s                 -        -
    ========  ====  ================  =======  ===========

    `progress` is the time along the path of the point that the cart is held to; it is a continuous
    state, 0 at first.

    Source: ours; the regulator is the usual one along a trajectory.

    Args:
        trailer: Parameters.
        path: To follow; forwards, backwards or both.
        weights: Of squared errors ahead, to the left (in trailer lengths), in theta and in beta
            (in radians), against the square of turn rate / turn-rate bound.

    Raises:
        InvalidInput: The path is none or a weight is not positive.
    """

    def __init__(
        self,
        trailer: Trailer,
        path: TrailerPath,
        *,
        weights: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    ):
        super().__init__()
        self._tracker = make_path_tracker(trailer, path, weights)
        self._state = self.DeclareVectorInputPort("state", 4)
        progress = self.DeclareContinuousState(1)
        self.DeclareVectorOutputPort("control", 2, self._calc_control)
        self.DeclareStateOutputPort("progress", progress)

    def get_state_input_port(self):
        """The cart's x, y, theta, beta, size 4 [m], [m], [rad], [rad]."""
        return self._state

    def get_control_output_port(self):
        """v, omega, size 2 [m/s], [rad/s]."""
        return self.GetOutputPort("control")

    def _control_and_rate(self, context):
        state = FollowerState(context.get_continuous_state_vector().CopyToVector())
        return tracking_control(self._tracker, read(self._state, context), state.progress)

    def _calc_control(self, context, output):
        output.set_value(self._control_and_rate(context)[0])

    # The stubs do not know the arguments' names.
    def DoCalcTimeDerivatives(self, context, derivatives):  # type: ignore[override]
        derivatives.get_mutable_vector().SetFromVector([self._control_and_rate(context)[1]])

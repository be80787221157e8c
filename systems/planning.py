"""LeafSystems of the planning story: the tractor-trailer, and what drives it."""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.framework import LeafSystem
from pydrake.systems.scalar_conversion import TemplateSystem
from pydrake.trajectories import PiecewisePolynomial

from .drake_parts import (
    AbstractValue,
    BasicVector_,
    LeafSystem_,
    NumericParameters,
    any_scalar,
    default_instance,
    read,
    with_scalars,
)
from .numerics.errors import require, require_finite, require_non_negative, require_positive
from .numerics.planning.path_tracking import make_path_tracker, tracking_control
from .numerics.planning.plan import TrailerPath, require_path
from .numerics.planning.trailer import Trailer, clip_control, trailer_pose, trailer_rates
from .numerics.planning.value_function.policy import AT_REST, Following, follow
from .numerics.planning.value_function.value_function import ValueFunction

TrailerState = namedview("TrailerState", ["x", "y", "theta", "beta"])
TrailerControl = namedview("TrailerControl", ["v", "omega"])


@TemplateSystem.define("TractorTrailer_", scope=sys.modules[__name__])
def TractorTrailer_(T):
    class Impl(LeafSystem_[T]):
        """A tractor that pulls, or pushes, one trailer.

        x' = v cos(theta), y' = v sin(theta), theta' = omega,
        beta' = omega - (v sin(beta) - M omega cos(beta)) / L, with L the trailer's length and M
        the hitch offset. Controls beyond the bounds are clipped: v to [0, speed], or to
        [-speed, speed] with reverse; omega to [-turn_rate, turn_rate].

        .. pydrake_system::

            name: TractorTrailer
            input_ports:
            - control
            output_ports:
            - state
            - trailer_pose

        ============  ====  ================  =======  ===========
        port          size  unit              frame    feedthrough
        ============  ====  ================  =======  ===========
        control       2     m/s, rad/s        tractor  -
        state         4     m, m, rad, rad    world    -
        trailer_pose  3     m, m, rad         world    -
        ============  ====  ================  =======  ===========

        `control` is v, omega; `state` is x, y, theta, beta: the tractor's rear axle, its heading
        and the angle from the trailer's heading to the tractor's; `trailer_pose` is the trailer's
        axle and its heading theta - beta. Angles are not wrapped: they count turns. The jackknife
        limit is the planners' to keep; the plant goes on beyond it. Numeric parameters: `speed`,
        `turn_rate`, `length`, `hitch_offset`. Defined for double, AutoDiffXd and Expression.

        Source: Zhang 2014, 3.2.2; the hitch offset is the usual extension.

        Args:
            trailer: Parameters.
            initial_state: x, y, theta, beta [m], [m], [rad], [rad].

        Raises:
            InvalidInput: The initial state is not four finite numbers.
        """

        def _construct(
            self,
            trailer: Trailer,
            initial_state: Sequence[float] = (0.0, 0.0, 0.0, 0.0),
            *,
            converter=None,
        ):
            LeafSystem_[T].__init__(self, converter=converter)
            initial = [float(value) for value in initial_state]
            require(len(initial) == 4, "initial_state", "be (x, y, theta, beta)", initial)
            for value in initial:
                require_finite("initial_state", value)
            self.trailer = trailer
            self.parameters = NumericParameters(
                self,
                T,
                speed=trailer.speed,
                turn_rate=trailer.turn_rate,
                length=trailer.length,
                hitch_offset=trailer.hitch_offset,
            )
            self.initial_state = tuple(initial)
            self._control = self.DeclareVectorInputPort("control", 2)
            state = self.DeclareContinuousState(BasicVector_[T](initial))
            self.DeclareStateOutputPort("state", state)
            self.DeclareVectorOutputPort(
                "trailer_pose",
                3,
                self._calc_trailer_pose,
                {self.all_state_ticket(), self.all_parameters_ticket()},
            )

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.trailer, other.initial_state, converter=converter)

        def get_control_input_port(self):
            """Speed and turn rate, size 2 [m/s], [rad/s]."""
            return self._control

        def get_state_output_port(self):
            """x, y, theta, beta, size 4 [m], [m], [rad], [rad]."""
            return self.GetOutputPort("state")

        def get_trailer_pose_output_port(self):
            """The trailer's axle and heading, size 3 [m], [m], [rad]."""
            return self.GetOutputPort("trailer_pose")

        def _trailer_in(self, context):
            """The trailer with the Context's numbers."""
            return with_scalars(self.trailer, **self.parameters(context)._asdict())

        @any_scalar(T)
        def DoCalcTimeDerivatives(self, context, derivatives):
            state = TrailerState(context.get_continuous_state_vector().CopyToVector())
            control = TrailerControl(self._control.Eval(context))
            trailer = self._trailer_in(context)
            v, omega = clip_control(control.v, control.omega, trailer)
            rates = trailer_rates(state.theta, state.beta, v, omega, trailer)
            derivatives.get_mutable_vector().SetFromVector(np.array(rates))

        @any_scalar(T)
        def _calc_trailer_pose(self, context, output):
            x, y, theta, beta = context.get_continuous_state_vector().CopyToVector()
            output.SetFromVector(
                np.array(trailer_pose(x, y, theta, beta, self._trailer_in(context)))
            )

    return Impl


# Any: the class is made at run time.
TractorTrailer: Any = default_instance(TractorTrailer_)


def control_trajectory(path: TrailerPath) -> PiecewisePolynomial:
    """v, omega over time, each held from one sample to the next [m/s], [rad/s].

    Raises:
        InvalidInput: The path has not two samples at increasing times.
    """
    require_path(path)
    held = np.concatenate([path.controls, path.controls[-1:]])
    return PiecewisePolynomial.ZeroOrderHold(path.times, held.T)


def state_trajectory(path: TrailerPath, trailer: Trailer) -> PiecewisePolynomial:
    """x, y, theta, beta over time [m], [m], [rad], [rad]: cubics with the path's own rates.

    They go through the samples, with the rates that the controls give on either side; in between
    the error falls with the fourth power of the time between samples.

    Raises:
        InvalidInput: The path has not two samples at increasing times.
    """
    require_path(path)
    v, omega = path.controls.T
    whole = PiecewisePolynomial()
    for k in range(len(path.controls)):
        samples = path.states[k : k + 2].T
        # The rates of a cusp or of a change of turn differ before and after it: one cubic each.
        rates = np.array(
            [trailer_rates(theta, beta, v[k], omega[k], trailer) for _, _, theta, beta in samples.T]
        ).T
        piece = PiecewisePolynomial.CubicHermite(path.times[k : k + 2], samples, rates)
        whole.ConcatenateInTime(piece)
    return whole


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


class ValueFunctionFeedback(LeafSystem):
    """Drives the cart down its time to go, and stops it in the goal box.

    It follows the best word of held controls that the table knows of, chooses the durations anew
    when what is measured would no longer lead into the box, and takes another word when that does
    not help: see `numerics.planning.value_function.policy`. Which word it follows is part of its
    state, so that it does not waver between two that take as long. Where the table promises nothing
    (off the grid, out of reach) the cart stops.

    .. pydrake_system::

        name: ValueFunctionFeedback
        input_ports:
        - state
        output_ports:
        - control

    =======  ====  ================  =======  ===========
    port     size  unit              frame    feedthrough
    =======  ====  ================  =======  ===========
    state    4     m, m, rad, rad    world    -
    control  2     m/s, rad/s        tractor  all
    =======  ====  ================  =======  ===========

    `state` holds x, y, theta, beta; `control` v, omega, held for a period. Defined for double. The
    word, the controls given last and where the cart is taken to be are an abstract state, updated
    once a period. Numeric parameters: `margin`, `trust`.

    Source: in place of Zhang 2014, (3.20), whose sign alone leads into loops.

    Args:
        value: The table.
        period: For how long a control is held [s].
        delay: From the moment of which `state` is until `control` acts [s].
        margin: Part of the goal box's half-widths by which to keep off its edge, in [0, 1), so
            that an error of the measurement does not lead past it.
        trust: Weight of a measurement against where those before it and the controls say that the
            cart is, in (0, 1]; 1: no filter.

    Raises:
        InvalidInput: The period is not positive, the delay negative, the margin or the trust out
            of range.
    """

    def __init__(
        self,
        value: ValueFunction,
        *,
        period: float = 0.05,
        delay: float = 0.0,
        margin: float = 0.1,
        trust: float = 0.3,
    ):
        super().__init__()
        require_positive("period", period)
        require_non_negative("delay", delay)
        require(0 <= margin < 1, "margin", "lie in [0, 1)", margin)
        require(0 < trust <= 1, "trust", "lie in (0, 1]", trust)
        self._value, self._period, self._delay = value, period, delay
        self.parameters = NumericParameters(self, margin=margin, trust=trust)
        self._state = self.DeclareVectorInputPort("state", 4)
        self._following = self.DeclareAbstractState(AbstractValue.Make(AT_REST))
        self.DeclareVectorOutputPort("control", 2, self._calc_control)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def get_state_input_port(self):
        """The cart's x, y, theta, beta, size 4 [m], [m], [rad], [rad]."""
        return self._state

    def get_control_output_port(self):
        """v, omega, size 2 [m/s], [rad/s]."""
        return self.GetOutputPort("control")

    def _next(self, context) -> Following:
        margin, trust = self.parameters(context)
        return follow(
            self._value,
            context.get_abstract_state(self._following).get_value(),
            read(self._state, context),
            period=self._period,
            delay=self._delay,
            margin=margin,
            trust=trust,
        )

    def _update(self, context, state):
        state.get_mutable_abstract_state(self._following).set_value(self._next(context))

    def _calc_control(self, context, output):
        following = context.get_abstract_state(self._following).get_value()
        # Before the first update it is what that will say.
        following = following if len(following.given) else self._next(context)
        output.SetFromVector(following.control)

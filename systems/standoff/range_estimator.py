"""A distance estimate that is off by a known curve."""

import sys
from typing import Any

from pydrake.systems.scalar_conversion import TemplateSystem

from ..drake_types import LeafSystem_, any_scalar, default_instance
from ..numerics.standoff.error_model import ErrorModel


@TemplateSystem.define("BiasedRangeEstimator_", scope=sys.modules[__name__])
def BiasedRangeEstimator_(T):
    class Impl(LeafSystem_[T]):
        """Estimates how far ahead the evader is, with the error of the thesis's camera.

        estimate = y - e(y) + noise, y = evader - pursuer, e(y) = a y^2 + b y + c.

        .. pydrake_system::

            name: BiasedRangeEstimator
            input_ports:
            - evader_position
            - pursuer_position
            - noise
            output_ports:
            - estimate

        ================  ====  ====  =====
        port              size  unit  frame
        ================  ====  ====  =====
        evader_position   1     m     line
        pursuer_position  1     m     line
        noise             1     m     line
        estimate          1     m     line
        ================  ====  ====  =====

        Defined for double, AutoDiffXd and Expression.

        Source: Zhang 2014, 2.2.6, (2.8).

        Args:
            error: The curve e(y).
        """

        def _construct(self, error: ErrorModel, *, converter=None):
            LeafSystem_[T].__init__(self, converter=converter)
            self.error = error
            self._evader = self.DeclareVectorInputPort("evader_position", 1)
            self._pursuer = self.DeclareVectorInputPort("pursuer_position", 1)
            self._noise = self.DeclareVectorInputPort("noise", 1)
            self.DeclareVectorOutputPort("estimate", 1, self._calc_estimate)

        def _construct_copy(self, other, converter=None):
            Impl._construct(self, other.error, converter=converter)

        def get_estimate_output_port(self):
            """Estimated distance, size 1 [m]."""
            return self.GetOutputPort("estimate")

        @any_scalar(T)
        def _calc_estimate(self, context, output):
            y = self._evader.Eval(context) - self._pursuer.Eval(context)
            output.SetFromVector(y - self.error.error(y) + self._noise.Eval(context))

    return Impl


# Any: the class is made at run time.
BiasedRangeEstimator: Any = default_instance(BiasedRangeEstimator_)

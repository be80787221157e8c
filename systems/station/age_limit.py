"""Validity from age."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive


class AgeLimit(LeafSystem):
    """Says which ages are within a limit.

    .. pydrake_system::

        name: AgeLimit
        input_ports:
        - age
        output_ports:
        - valid

    =====  ====  ====  =====  ===========
    port   size  unit  frame  feedthrough
    =====  ====  ====  =====  ===========
    age    N     s     -      -
    valid  N     -     -      all
    =====  ====  ====  =====  ===========

    `valid` is 1 up to the limit, else 0. Numeric parameters: `limit`.

    Source: ours.

    Args:
        count: Number of members N.
        limit: [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, count: int, *, limit: float):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("limit", limit)
        self.parameters = NumericParameters(self, limit=limit)
        self._age = self.DeclareVectorInputPort("age", count)
        self.DeclareVectorOutputPort("valid", count, self._calc_valid)

    def _calc_valid(self, context, output):
        limit = self.parameters(context).limit
        output.set_value((read(self._age, context) <= limit).astype(float))

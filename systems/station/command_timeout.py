"""What a robot does whose radio has fallen silent."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive
from ..numerics.station.freshness import freshness


class CommandTimeout(LeafSystem):
    """Passes on commands while they are fresh, and zero to a robot that has not heard for long.

    .. pydrake_system::

        name: CommandTimeout
        input_ports:
        - command
        - stamp
        output_ports:
        - obeyed_command

    ==============  ====  ==========  =====  ===========
    port            size  unit        frame  feedthrough
    ==============  ====  ==========  =====  ===========
    command         2 N   m/s, rad/s  robot  -
    stamp           N     s           -      -
    obeyed_command  2 N   m/s, rad/s  robot  all
    ==============  ====  ==========  =====  ===========

    Numeric parameters: `limit`.

    Source: ours; what the firmware does on loss of the heartbeat.

    Args:
        count: Number of robots N.
        limit: How old the last command may be [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, count: int, *, limit: float):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("limit", limit)
        self.parameters = NumericParameters(self, limit=limit)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._stamp = self.DeclareVectorInputPort("stamp", count)
        self.DeclareVectorOutputPort("obeyed_command", 2 * count, self._calc_obeyed_command)

    def _calc_obeyed_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2)
        limit = self.parameters(context).limit
        valid, _ = freshness(context.get_time(), read(self._stamp, context), limit)
        output.set_value(np.where(valid[:, None] > 0.5, commands, 0.0).ravel())

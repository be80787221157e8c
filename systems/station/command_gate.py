"""What of a controller's commands goes to the robots."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require

# What the operator's mode says.
RUNNING, PAUSED, STOPPED = 1.0, 0.0, -1.0


class CommandGate(LeafSystem):
    """Lets commands through to robots that may follow them, while the operator lets them run.

    All others get zero. A robot that nobody sees stands, so that where it was last seen is where
    it is, for it and for the others.

    .. pydrake_system::

        name: CommandGate
        input_ports:
        - command
        - valid
        - mode
        output_ports:
        - sent_command

    ============  ====  ==========  =====  ===========
    port          size  unit        frame  feedthrough
    ============  ====  ==========  =====  ===========
    command       2 N   m/s, rad/s  robot  -
    valid         N     -           -      -
    mode          1     -           -      -
    sent_command  2 N   m/s, rad/s  robot  all
    ============  ====  ==========  =====  ===========

    `valid` is above 0.5 for robots that may follow their commands. `mode` is 1 to run, 0 for a
    pause, -1 for an emergency stop. A command that is not finite is zero as well.

    Source: ours.

    Args:
        count: Number of robots N.

    Raises:
        InvalidInput: The number is not positive.
    """

    def __init__(self, count: int):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._valid = self.DeclareVectorInputPort("valid", count)
        self._mode = self.DeclareVectorInputPort("mode", 1)
        self.DeclareVectorOutputPort("sent_command", 2 * count, self._calc_sent_command)

    def _calc_sent_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2)
        good = (read(self._valid, context) > 0.5) & np.isfinite(commands).all(axis=1)
        good &= read(self._mode, context)[0] == RUNNING
        output.set_value(np.where(good[:, None], commands, 0.0).ravel())

"""Drive commands that keep robots apart."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.station.spacing import spaced_commands


class RobotSpacing(LeafSystem):
    """Slows robots that would come too near to others, whatever a strategy wants.

    .. pydrake_system::

        name: RobotSpacing
        input_ports:
        - pose
        - command
        output_ports:
        - spaced_command

    ==============  ====  ==========  =====
    port            size  unit        frame
    ==============  ====  ==========  =====
    pose            3 N   m, m, rad   world
    command         2 N   m/s, rad/s  robot
    spaced_command  2 N   m/s, rad/s  robot
    ==============  ====  ==========  =====

    Source: ours; the thesis's tracking (2.2.8) does not keep robots from one another.

    Args:
        count: Number of robots N.
        spacing: Least distance between centres, 0 for none [m].
        horizon: Longer than a command takes to have effect [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(self, count: int, *, spacing: float, horizon: float = 0.4):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_non_negative("spacing", spacing)
        require_positive("horizon", horizon)
        self._spacing, self._horizon = float(spacing), float(horizon)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self.DeclareVectorOutputPort("spaced_command", 2 * count, self._calc_spaced_command)

    def _calc_spaced_command(self, context, output):
        commands = read(self._command, context)
        if self._spacing > 0:
            poses = read(self._pose, context).reshape(-1, 3)
            spaced = spaced_commands(commands.reshape(-1, 2), poses, self._spacing, self._horizon)
            commands = spaced.ravel()
        output.set_value(commands)

"""Input ports shared by the systems of a tracking game, and the pursuit field based on them."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import Context, LeafSystem

from ..drake_parts import read
from ..numerics.errors import InvalidInput, require, require_non_negative, require_one_of
from ..numerics.geometry.world import World
from ..numerics.tracking.assignment.team_view import names_evaders
from ..numerics.tracking.corner_game import corner_table
from ..numerics.tracking.corner_policies import FIELDS
from ..numerics.tracking.risk import RISK_VECTORS
from ..numerics.tracking.sight_state import sight_size
from ..numerics.tracking.team_pursuit import team_pursuit


class GamePorts:
    """Ports `pursuer_position`, `evader_position` and `sight`, and `assignment` if `assigned`.

    Attributes:
        corners: Of the world, from `corner_table`.
        shape: Np and Ne.
        pursuers, evaders, sight: The ports.
    """

    def __init__(
        self,
        system: LeafSystem,
        world: World,
        pursuers: int,
        evaders: int,
        *,
        assigned: bool = False,
    ):
        """Declares the ports; to be called once, in the system's constructor.

        Args:
            system: System on which the ports are declared.
            world: Whose corners the sight port refers to.
            pursuers: Number of pursuers Np.
            evaders: Number of evaders Ne.
            assigned: Whether to declare the port `assignment`.
        """
        self.corners = corner_table(world)
        self.shape = (pursuers, evaders)
        self.pursuers = system.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self.evaders = system.DeclareVectorInputPort("evader_position", 2 * evaders)
        size = sight_size(pursuers, evaders, len(self.corners))
        self.sight = system.DeclareVectorInputPort("sight", size)
        if assigned:
            self.assignment = system.DeclareVectorInputPort("assignment", pursuers)

    def positions(self, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """Where pursuers and evaders are, shapes (2 Np,), (2 Ne,) [m]."""
        return read(self.pursuers, context), read(self.evaders, context)

    def visible(self, context: Context) -> np.ndarray:
        """Which evader each pursuer sees, shape (Np, Ne), bool."""
        n, m = self.shape
        return read(self.sight, context)[: n * m].reshape(n, m) > 0.5

    def targets(self, context: Context) -> np.ndarray:
        """Each pursuer's evader, -1 for none, shape (Np,).

        Raises:
            InvalidInput: The assignment names no evader.
        """
        assignment = read(self.assignment, context)
        require_assignment(assignment, self.shape[1])
        return assignment


class FieldRule:
    """The pursuit field (2.2) of a team, evaluated from the ports of a system."""

    def __init__(self, ports: GamePorts, field: str, risk_vectors: Sequence[str], period: float):
        """Checks and stores the parameters of the field.

        Args:
            ports: Of the system.
            field: A name in `FIELDS`.
            risk_vectors: Names in `RISK_VECTORS`, one for all pursuers or one each.
            period: For how long a velocity is held, 0 for continuous time [s].

        Raises:
            InvalidInput: A name is unknown, or the period negative.
        """
        require_one_of("field", field, FIELDS)
        require_non_negative("period", period)
        self._ports, self._field, self._period = ports, FIELDS[field], float(period)
        self._weightings = codes_of("risk_vectors", risk_vectors, RISK_VECTORS, ports.shape[0])

    def velocities(
        self, context: Context, assignment: np.ndarray, ratio: float, speed: float
    ) -> np.ndarray:
        """Velocities of the team, each member after its own evader, shape (2 Np,) [m/s].

        Args:
            context: Of the system.
            assignment: Each pursuer's evader, -1 for none, shape (Np,).
            ratio: Speed ratio a = v_e / v_p.
            speed: Pursuers' top speed [m/s].
        """
        ports = self._ports
        return team_pursuit(
            self._field,
            self._weightings,
            *ports.positions(context),
            read(ports.sight, context),
            assignment,
            ports.corners,
            ratio,
            speed,
            self._period,
        )


def require_assignment(assignment: np.ndarray, evaders: int) -> None:
    """Refuse an assignment with invalid entries, because compiled code does not check indices.

    Args:
        assignment: Each pursuer's evader, -1 for none, shape (Np,).
        evaders: How many there are.

    Raises:
        InvalidInput: An entry is neither an evader nor -1.
    """
    if not names_evaders(assignment, evaders):
        raise InvalidInput(
            f"`assignment` must name evaders from 0 to {evaders - 1}, or -1; "
            f"got {assignment.tolist()}"
        )


def codes_of(name: str, names: Sequence[str], codes: dict[str, int], count: int) -> np.ndarray:
    """Codes of `count` names, a single name standing for all; shape (count,).

    Raises:
        InvalidInput: A name is not among `codes`, or their number is neither 1 nor `count`.
    """
    for each in names:
        require_one_of(name, each, codes)
    require(len(names) in (1, count), name, f"have 1 or {count} entries", list(names))
    return np.array([codes[each] for each in names] * (count if len(names) == 1 else 1))

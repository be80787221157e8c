"""Which evader each pursuer goes after."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require, require_one_of
from ..numerics.geometry.world import World
from ..numerics.tracking.assignment.rules import RULES, AssignmentRule
from ..numerics.tracking.assignment.team_view import EXTRA_PURSUERS, TeamView
from ..numerics.tracking.corner_table import corner_table
from ..numerics.tracking.risk import RISK_FUNCTIONS, team_risk


class Assignment(LeafSystem):
    """Gives each pursuer an evader that it sees, or none (-1), by a rule on the team's risks.

    .. pydrake_system::

        name: Assignment
        input_ports:
        - pursuer_position
        - evader_position
        - visibility
        - pursuer_corners
        - evader_corners
        output_ports:
        - assignment

    ================  =====  ====  =====
    port              size   unit  frame
    ================  =====  ====  =====
    pursuer_position  2 Np   m     world
    evader_position   2 Ne   m     world
    visibility        Np Ne  -     -
    pursuer_corners   Np K   -     -
    evader_corners    Ne K   -     -
    assignment        Np     -     -
    ================  =====  ====  =====

    Source: Zhang 2014, 2.2.3.2, (2.3), (2.13), Algorithm 1.

    Args:
        world: Whose corners the risks refer to.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        rule: A name in `RULES`, or a function of a TeamView.
        risk_functions: Names in `RISK_FUNCTIONS`, one for all pursuers or one each.
        extra: What pursuers beyond a matching do: "stay" or "riskiest".
        seed: For rules that draw lots.

    Raises:
        InvalidInput: A name is unknown or the number of risk functions is wrong.
    """

    def __init__(
        self,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        rule: str | AssignmentRule = "hungarian",
        risk_functions: Sequence[str] = ("total",),
        extra: str = "stay",
        seed: int = 0,
    ):
        super().__init__()
        if isinstance(rule, str):
            require_one_of("rule", rule, RULES)
            rule = RULES[rule]
        require_one_of("extra", extra, EXTRA_PURSUERS)
        self._rule: AssignmentRule = rule
        self._kinds = codes_of("risk_functions", risk_functions, RISK_FUNCTIONS, pursuers)
        self._extra, self._seed = extra, seed
        self._corners = corner_table(world)
        self._shape = (pursuers, evaders)
        corners = len(self._corners)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        self._visibility = self.DeclareVectorInputPort("visibility", pursuers * evaders)
        self._pursuer_corners = self.DeclareVectorInputPort("pursuer_corners", pursuers * corners)
        self._evader_corners = self.DeclareVectorInputPort("evader_corners", evaders * corners)
        self.DeclareVectorOutputPort("assignment", pursuers, self._calc_assignment)

    def _calc_assignment(self, context, output):
        evaders = read(self._evaders, context)
        risk = team_risk(
            self._kinds,
            evaders,
            read(self._pursuer_corners, context),
            read(self._evader_corners, context),
            self._corners,
        )
        view = TeamView(
            visible=read(self._visibility, context).reshape(self._shape) > 0.5,
            risk=risk,
            pursuers=read(self._pursuers, context).reshape(-1, 2),
            evaders=evaders.reshape(-1, 2),
            extra=self._extra,
            seed=self._seed,
        )
        output.set_value(self._rule(view))


def codes_of(name: str, names: Sequence[str], codes: dict[str, int], count: int) -> np.ndarray:
    """Codes of `count` names, a single name standing for all.

    Raises:
        InvalidInput: A name is not among `codes`, or their number is neither 1 nor `count`.
    """
    for each in names:
        require_one_of(name, each, codes)
    require(len(names) in (1, count), name, f"have 1 or {count} entries", list(names))
    return np.array([codes[each] for each in names] * (count if len(names) == 1 else 1))

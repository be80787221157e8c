"""Who sees whom among the obstacles, and who sees which corner."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.team_sight import corner_sight, edges_at, sight_matrix
from ..numerics.geometry.world import World


class LineOfSight(LeafSystem):
    """Sight between two teams, and from each team to the corners of the obstacles.

    Entry i m + j of `visibility` is 1 where the closed free region covers the line from pursuer
    i to evader j, else 0; corners are the K reflex vertices of the world, in the order of
    `World.corners`.

    .. pydrake_system::

        name: LineOfSight
        input_ports:
        - pursuer_position
        - evader_position
        output_ports:
        - visibility
        - pursuer_corners
        - evader_corners

    ================  =====  ====  =====
    port              size   unit  frame
    ================  =====  ====  =====
    pursuer_position  2 Np   m     world
    evader_position   2 Ne   m     world
    visibility        Np Ne  -     -
    pursuer_corners   Np K   -     -
    evader_corners    Ne K   -     -
    ================  =====  ====  =====

    Source: Zhang 2014, 2.2.1 and 2.2.3.

    Args:
        world: Whose obstacles block sight.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.

    Raises:
        InvalidInput: A team is empty.
    """

    def __init__(self, world: World, *, pursuers: int, evaders: int):
        super().__init__()
        require(pursuers > 0, "pursuers", "be positive", pursuers)
        require(evaders > 0, "evaders", "be positive", evaders)
        self._index = build_edge_index(world)
        self._corners = np.ascontiguousarray(world.corners.points).ravel()
        self._at_corners = edges_at(self._index, world.corners.points)
        corners = len(world.corners)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        from_pursuers = {self._pursuers.ticket()}
        from_evaders = {self._evaders.ticket()}
        self.DeclareVectorOutputPort(
            "visibility", pursuers * evaders, self._calc_visibility, from_pursuers | from_evaders
        )
        self.DeclareVectorOutputPort(
            "pursuer_corners", pursuers * corners, self._calc_pursuer_corners, from_pursuers
        )
        self.DeclareVectorOutputPort(
            "evader_corners", evaders * corners, self._calc_evader_corners, from_evaders
        )

    def _calc_visibility(self, context, output):
        pursuers, evaders = read(self._pursuers, context), read(self._evaders, context)
        output.set_value(sight_matrix(self._index, pursuers, evaders))

    def _calc_pursuer_corners(self, context, output):
        output.set_value(self._see_corners(read(self._pursuers, context)))

    def _calc_evader_corners(self, context, output):
        output.set_value(self._see_corners(read(self._evaders, context)))

    def _see_corners(self, positions: np.ndarray) -> np.ndarray:
        return corner_sight(self._index, positions, self._corners, self._at_corners)

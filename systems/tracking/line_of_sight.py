"""Who sees whom among the obstacles, and who sees which corner."""

from collections.abc import Sequence

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require
from ..numerics.geometry.body_sight import checked_radii
from ..numerics.geometry.corner_sight import build_corner_index
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.world import World
from ..numerics.tracking.sight_state import observe, sight_size


class LineOfSight(LeafSystem):
    """Sight between two teams, and from each team to the corners of the obstacles.

    `sight` holds three blocks, 1 where the closed free region covers the line and else 0: which
    evader each pursuer sees (Np x Ne, row by row), which corner each pursuer sees (Np x K), which
    corner each evader sees (Ne x K). Corners are the reflex vertices of the world, in the order
    of `World.corners`; `split_sight` takes the blocks apart.

    With `body_radii` a pursuer does not see an evader past a third robot either, through the
    inside of whose round body the line passes. Corners are seen past bodies, which move on.

    .. pydrake_system::

        name: LineOfSight
        input_ports:
        - pursuer_position
        - evader_position
        output_ports:
        - sight

    ================  =====================  ====  =====  ===========
    port              size                   unit  frame  feedthrough
    ================  =====================  ====  =====  ===========
    pursuer_position  2 Np                   m     world  -
    evader_position   2 Ne                   m     world  -
    sight             Np Ne + Np K + Ne K    -     -      all
    ================  =====================  ====  =====  ===========

    Source: Zhang 2014, 2.2.1 and 2.2.3.

    Args:
        world: Whose obstacles block sight.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        body_radii: Of the robots, pursuers first, Np + Ne of them [m]; empty: bodies do not block
            sight.

    Raises:
        InvalidInput: A team is empty; there is not one radius for each robot, or one is negative.
    """

    def __init__(
        self, world: World, *, pursuers: int, evaders: int, body_radii: Sequence[float] = ()
    ):
        super().__init__()
        require(pursuers > 0, "pursuers", "be positive", pursuers)
        require(evaders > 0, "evaders", "be positive", evaders)
        self._radii = checked_radii(body_radii, pursuers + evaders)
        self._index = build_edge_index(world)
        self._corners = build_corner_index(world, self._index)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        size = sight_size(pursuers, evaders, len(world.corners))
        self.DeclareVectorOutputPort("sight", size, self._calc_sight)

    def _calc_sight(self, context, output):
        pursuers, evaders = read(self._pursuers, context), read(self._evaders, context)
        output.set_value(observe(self._index, self._corners, pursuers, evaders, self._radii))

"""What does not move: the floor, the green obstacles and the orange grown boundaries."""

from collections.abc import Sequence

import shapely

from ....systems.numerics.geometry.world import World
from ...visuals.meshes import extruded_mesh, flat_mesh, line_mesh
from ...visuals.stage import Stage
from .layout import GROWN_BOUNDARY, OBSTACLE, PAPER, Layout


def draw_world(stage: Stage, layout: Layout, world: World, grown: Sequence[World]) -> None:
    """Draw a world and the boundaries that the centres of its robots keep to.

    Args:
        stage: Where to draw.
        layout: Sizes of what has no size of its own.
        world: The free region.
        grown: The free region shrunk by a robot's radius; in pieces, where that splits it.
    """
    outline = shapely.Polygon(world.boundary)
    stage.mesh("world/floor", flat_mesh(outline), PAPER)
    wall = outline.buffer(layout.wall, join_style="mitre").difference(outline)
    solid = [shapely.Polygon(ring) for ring in world.obstacles]
    height = layout.obstacle_height
    stage.mesh("world/wall", extruded_mesh(wall, 0.0, height), OBSTACLE)
    for k, obstacle in enumerate(solid):
        stage.mesh(f"world/obstacles/{k}", extruded_mesh(obstacle, 0.0, height), OBSTACLE)
    stage.raise_to("boundaries", layout.level("boundaries"))
    rings = [ring for piece in grown for ring in piece.rings]
    if rings:
        stage.mesh("boundaries", line_mesh(rings, 1.3 * layout.line), GROWN_BOUNDARY)

"""A scenario of the social story made concrete: the maze, who starts where, how agents answer."""

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ...systems.numerics.errors import InvalidInput, require, require_type
from ...systems.numerics.geometry.world import World
from ...systems.numerics.social.landmarks.forward_camera import ForwardCamera
from ...systems.numerics.social.landmarks.maze import Maze
from ...systems.numerics.social.landmarks.thesis_maze import hang_landmarks, thesis_maze
from ...systems.numerics.social.network.acceptance import (
    MutualFriendsAcceptance,
    OwnAcceptance,
    Temperaments,
)
from ...systems.numerics.social.network.evolution import EvolutionLimits
from ...systems.numerics.social.routes.infrared import InfraredRing
from ...systems.numerics.social.routes.shortest_route import rounded_regions
from .scenario import MazeSource, SocialScenario

# What is left between a robot and a wall, and what routes keep beyond that [m].
WALL_GAP, ROUTE_GAP = 0.03, 0.015
# Turn-rate limit of every robot [rad/s].
TOP_TURN_RATE = 3.0
# Robots start at least so far from one another, from middle to middle [m].
_APART = 0.3
_MAX_DRAWS = 2000


@dataclass(frozen=True, eq=False)
class SocialGame:
    """A search ready to begin. Robots are numbered: the pursuer, the evader, the common agents.

    Attributes:
        scenario: Where it comes from.
        maze: Walls, landmarks, cameras, what robots look like.
        regions: Where robots' centres may be.
        route_regions: Where routes may lead, a little less.
        ring: Everybody's infrared sensors.
        starts: Poses of all robots, shape (2 + agents, 3) [m], [m], [rad].
        temperaments: How the agents answer.
        limits: N_req, T_wait and N_f.
    """

    scenario: SocialScenario
    maze: Maze
    regions: tuple[World, ...]
    route_regions: tuple[World, ...]
    ring: InfraredRing
    starts: np.ndarray
    temperaments: Temperaments
    limits: EvolutionLimits

    @property
    def robots(self) -> int:
        """Number of robots."""
        return len(self.starts)


def set_up_social_game(scenario: SocialScenario) -> SocialGame:
    """Hang the landmarks and place the robots.

    Raises:
        InvalidInput: The world is no free region, or has no room for landmarks or robots; a robot
            starts in a wall or in another one.
    """
    require_type("scenario", scenario, SocialScenario)
    maze = _maze(scenario)
    regions = rounded_regions(maze.world, maze.robot_radius + WALL_GAP)
    agents, search = scenario.agents, scenario.search
    friending = tuple(agents.friending)
    if agents.acquaintances:
        pairs = frozenset((pair[0], pair[1]) for pair in agents.acquaintances)
        acceptance = MutualFriendsAcceptance(friending, pairs, agents.persuasion)
    else:
        acceptance = OwnAcceptance(friending)
    return SocialGame(
        scenario=scenario,
        maze=maze,
        regions=regions,
        route_regions=rounded_regions(maze.world, maze.robot_radius + WALL_GAP + ROUTE_GAP),
        ring=InfraredRing(),
        starts=_starts(scenario, maze, regions),
        temperaments=Temperaments(
            acceptance=acceptance,
            unfriending=tuple(agents.unfriending),
            rejection=tuple(agents.rejection) or (0.2,) * agents.size,
        ),
        limits=EvolutionLimits(
            requests=search.requests,
            patience=search.patience,
            friends=search.friends or agents.size,
        ),
    )


def _maze(scenario: SocialScenario) -> Maze:
    source: MazeSource = scenario.maze
    if source.world is None:
        maze = thesis_maze()
    else:
        world = source.world.load()
        hung = hang_landmarks(world, source.landmarks, side=source.landmark_side)
        maze = Maze(world=world, landmarks=hung)
    camera = ForwardCamera(
        width=scenario.camera.width,
        height=scenario.camera.height,
        field_of_view=math.radians(scenario.camera.view_angle),
    )
    return replace(maze, camera=camera)


def _starts(scenario: SocialScenario, maze: Maze, regions: tuple[World, ...]) -> np.ndarray:
    """Poses of all robots: as given, the others drawn where there is room."""
    agents = scenario.agents
    given = [
        scenario.pursuer.pose,
        scenario.evader.pose,
        *(agents.poses or [[]] * agents.size),
    ]
    names = ["pursuer.pose", "evader.pose", *(f"agents.poses.{i}" for i in range(agents.size))]
    poses = np.full((len(given), 3), np.nan)
    free = shapely.union_all([region.polygon for region in regions])
    shapely.prepare(free)
    for i, (name, pose) in enumerate(zip(names, given, strict=True)):
        if not pose:
            continue
        require(
            bool(shapely.intersects_xy(free, pose[0], pose[1])),
            name,
            f"be {maze.robot_radius + WALL_GAP:g} m from walls",
            pose,
        )
        apart = np.hypot(*(poses[:, :2] - pose[:2]).T)
        require(
            not bool((apart < 2 * maze.robot_radius).any()), name, "not touch another robot", pose
        )
        poses[i] = pose
    # The largest part only: from another one a robot could meet nobody.
    room = regions[0].polygon
    shapely.prepare(room)
    generator = np.random.default_rng(scenario.seed)
    low, high = regions[0].bounds[:2], regions[0].bounds[2:]
    for i in np.flatnonzero(np.isnan(poses[:, 0])):
        for _ in range(_MAX_DRAWS):
            x, y = generator.uniform(low, high)
            apart = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
            if shapely.contains_xy(room, x, y) and not (apart < _APART).any():
                poses[i] = x, y, generator.uniform(-math.pi, math.pi)
                break
        else:
            raise InvalidInput(f"`agents` must fit into the maze; no room for {names[i]}")
    return poses

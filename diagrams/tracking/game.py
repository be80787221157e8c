"""A scenario made concrete: its world, where robots may go, where they start."""

from dataclasses import dataclass, replace

import numpy as np
import shapely
import shapely.ops

from ...systems.numerics.errors import InvalidInput, require, require_type
from ...systems.numerics.geometry.edge_index import build_edge_index, clearances, point_is_free
from ...systems.numerics.geometry.team_sight import sight_matrix
from ...systems.numerics.geometry.wall_sliding import SKIN
from ...systems.numerics.geometry.world import World, shrink_world
from ...systems.numerics.tracking.random_starts import draw_starts
from .scenario import RobotTeam, TrackingScenario


@dataclass(frozen=True, eq=False)
class TrackingGame:
    """A game ready to be played.

    Attributes:
        scenario: Where it comes from.
        world: Whose obstacles block sight.
        pursuer_regions, evader_regions: Where the robots' centres may be, largest part first.
        pursuer_starts: Poses, shape (Np, 3) [m], [m], [rad].
        evader_starts: Poses, shape (Ne, 3).
    """

    scenario: TrackingScenario
    world: World
    pursuer_regions: tuple[World, ...]
    evader_regions: tuple[World, ...]
    pursuer_starts: np.ndarray
    evader_starts: np.ndarray

    @property
    def radii(self) -> np.ndarray:
        """Radii of all robots, pursuers first, shape (Np + Ne,) [m]."""
        pursuers, evaders = self.scenario.pursuers, self.scenario.evaders
        return np.repeat([pursuers.radius, evaders.radius], [pursuers.size, evaders.size])


def set_up_game(scenario: TrackingScenario, world: World | None = None) -> TrackingGame:
    """Load a scenario's world and place its teams.

    Args:
        scenario: What is played.
        world: The scenario's world, where it is loaded already.

    Raises:
        InvalidInput: The world is no free region; a robot starts outside it, in an obstacle, or
            on another robot's spot; an evader starts where nobody sees it; there is no room.
    """
    require_type("scenario", scenario, TrackingScenario)
    world = world or scenario.world.load()
    pursuer_regions = _regions(world, "pursuers", scenario.pursuers.radius)
    evader_regions = _regions(world, "evaders", scenario.evaders.radius)
    pursuers, evaders = _positions(scenario, world, pursuer_regions[0], evader_regions[0])
    pursuers = _checked(scenario.pursuers, "pursuers", pursuers, world, pursuer_regions)
    evaders = _checked(scenario.evaders, "evaders", evaders, world, evader_regions)
    _require_distinct(scenario, pursuers, evaders)
    radii = np.array(scenario.blocking_radii) if scenario.bodies_block_sight else None
    seen = sight_matrix(build_edge_index(world), pursuers.ravel(), evaders.ravel(), radii)
    for j in np.flatnonzero(~seen.reshape(len(pursuers), -1).any(axis=0)):
        raise InvalidInput(
            f"`evaders.positions.{j}` must be in sight of a pursuer; got {_show(evaders[j])}"
        )
    return TrackingGame(
        scenario,
        world,
        pursuer_regions,
        evader_regions,
        _poses(scenario.pursuers, pursuers),
        _poses(scenario.evaders, evaders),
    )


# What `with_random_starts` takes from a scenario.
STARTS = tuple(
    f"{team}.{what}" for team in ("pursuers", "evaders") for what in ("positions", "headings")
)


def with_random_starts(scenario: TrackingScenario) -> TrackingScenario:
    """The same teams, to be placed at random by the seed.

    Raises:
        InvalidInput: An evader follows waypoints, which belong to one world.
    """
    require(
        "waypoints" not in scenario.evaders.policy_of_each,
        "evaders.policies",
        "not be waypoints in another world",
        scenario.evaders.policies,
    )
    pursuers, evaders = scenario.pursuers, scenario.evaders
    return replace(
        scenario,
        pursuers=replace(pursuers, count=pursuers.size, positions=[], headings=[]),
        evaders=replace(evaders, count=evaders.size, positions=[], headings=[]),
    )


def _regions(world: World, team: str, radius: float) -> tuple[World, ...]:
    """Where robots of a team may be, largest part first."""
    try:
        return shrink_world(world, radius)
    except InvalidInput:
        raise InvalidInput(
            f"`{team}.radius` must leave free space in the world; got {radius}"
        ) from None


def _positions(
    scenario: TrackingScenario, world: World, pursuer_region: World, evader_region: World
) -> tuple[np.ndarray, np.ndarray]:
    """Positions of both teams, given or drawn; a team that is drawn does not move the other."""
    pursuers, evaders = scenario.pursuers, scenario.evaders
    require(
        bool(pursuers.positions) == bool(evaders.positions),
        "positions",
        "be given for both teams or for none",
        "one",
    )
    if pursuers.positions:
        return np.array(pursuers.positions), np.array(evaders.positions)
    return draw_starts(
        world,
        pursuer_region,
        evader_region,
        pursuer_radius=pursuers.radius,
        evader_radius=evaders.radius,
        pursuers=pursuers.size,
        evaders=evaders.size,
        seed=scenario.seed,
    )


def _checked(
    team: RobotTeam, name: str, positions: np.ndarray, world: World, regions: tuple[World, ...]
) -> np.ndarray:
    """Positions moved off the walls by the skin that wall sliding keeps, if they touch one."""
    index, free = build_edge_index(world), build_edge_index(*regions)
    gaps = clearances(index, positions)
    for i, (x, y) in enumerate(positions):
        key = f"{name}.positions.{i}"
        require(point_is_free(index, x, y), key, "be in free space", _show(positions[i]))
        require(
            point_is_free(free, x, y),
            key,
            f"keep the radius of {team.radius} m from obstacles",
            f"{_show(positions[i])} at {gaps[i]:.4g} m",
        )
    return _off_the_walls(positions, regions)


def _off_the_walls(positions: np.ndarray, regions: tuple[World, ...]) -> np.ndarray:
    """Move points that touch the rim of their region inwards by a skin."""
    moved = positions.copy()
    for region in regions:
        skin = 2.0 * SKIN * region.tolerance
        near = clearances(build_edge_index(region), moved) < skin
        if near.any():
            inner = region.polygon.buffer(-skin, join_style="mitre")
            for i in np.flatnonzero(near):
                point = shapely.ops.nearest_points(inner, shapely.Point(moved[i]))[0]
                moved[i] = point.x, point.y
    return moved


def _require_distinct(
    scenario: TrackingScenario, pursuers: np.ndarray, evaders: np.ndarray
) -> None:
    """No two robots on one spot, but for pursuers that are alternatives; no two that touch."""
    names = [f"pursuers.positions.{i}" for i in range(len(pursuers))]
    names += [f"evaders.positions.{j}" for j in range(len(evaders))]
    points = np.concatenate([pursuers, evaders])
    radii = np.repeat(
        [scenario.pursuers.radius, scenario.evaders.radius], [len(pursuers), len(evaders)]
    )
    for i in range(len(points)):
        for j in range(i):
            alternatives = scenario.pursuers.alternatives and max(i, j) < len(pursuers)
            distance = np.hypot(*(points[i] - points[j]))
            if not alternatives and distance <= 1e-9:
                raise InvalidInput(
                    f"`{names[i]}` must not be the spot of {names[j]}; got {_show(points[i])}"
                )
            contact = radii[i] + radii[j]
            if scenario.has_bodies and distance <= contact:
                raise InvalidInput(
                    f"`{names[i]}` must be {contact:.4g} m from {names[j]}, so that the robots do "
                    f"not touch; got {distance:.4g} m"
                )


def _poses(team: RobotTeam, positions: np.ndarray) -> np.ndarray:
    headings = np.array(team.headings) if team.headings else np.zeros(len(positions))
    return np.column_stack([positions, headings])


def _show(point: np.ndarray) -> str:
    return f"[{point[0]:.6g}, {point[1]:.6g}]"

"""A game whose every move is known, drawn by the scene, and a page on which to look at it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import shapely
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from sightfield.diagrams.tracking.scene import TrackingScene, View
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.systems.numerics.geometry.world import World, make_world, world_from_polygon

RADIUS = 0.12
PERIOD = 0.05
END = 4.0

# Pursuer 0 goes north for 2 s and then stands; pursuer 1 stands for 2 s and then goes east. The
# evaders go round; evader 0 stands.
TIMES = [0.0, 2.0, 4.0]
PURSUERS = [[[0.5, 0.5], [0.5, 2.5], [0.5, 2.5]], [[1.0, 0.4], [1.0, 0.4], [3.0, 0.4]]]
EVADERS = [
    [[3.5, 2.5], [3.5, 2.5], [3.5, 2.5]],
    [[2.0, 2.0], [1.2, 2.2], [2.0, 2.6]],
    [[3.0, 0.5], [3.6, 1.5], [3.0, 2.2]],
]
# From the first time on, and so on.
CHANGES = [0.0, 1.0, 2.5]
VISIBILITY = [[[1, 0, 1], [0, 1, 1]], [[1, 0, 0], [0, 1, 0]], [[0, 1, 1], [1, 1, 0]]]
ASSIGNMENT = [[0, 1], [0, -1], [2, 0]]


def make_arena() -> World:
    return make_world(
        [[0, 0], [4, 0], [4, 3], [0, 3]], [[[1.5, 1.1], [2.5, 1.1], [2.5, 1.7], [1.5, 1.7]]]
    )


def box_around(point: np.ndarray) -> np.ndarray:
    """A stand-in for a visibility polygon: the square of half-width 0.3 m about a point."""
    return point + 0.3 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def eastward(
    pursuer: int, points: np.ndarray, evaders: np.ndarray, assignment: np.ndarray
) -> np.ndarray:
    """A stand-in for a pursuit field: to the east, everywhere."""
    return np.tile([1.0, 0.0], (len(points), 1))


@dataclass(frozen=True)
class Game:
    """A diagram that plays and draws the known game of 2 pursuers and 3 evaders for 4 s."""

    diagram: Diagram
    scene: TrackingScene
    meshcat: Meshcat

    def positions(self, team: str, time: float) -> np.ndarray:
        """Where a team is, shape (n, 2) [m]."""
        tracks = np.array(PURSUERS if team == "pursuers" else EVADERS)
        return np.array([[np.interp(time, TIMES, track[:, k]) for k in (0, 1)] for track in tracks])

    def visibility(self, time: float) -> np.ndarray:
        """Who sees whom, shape (2, 3)."""
        return np.array(VISIBILITY[np.searchsorted(CHANGES, time + 1e-9) - 1], dtype=bool)

    def assignment(self, time: float) -> np.ndarray:
        """Who chases whom, shape (2,)."""
        return np.array(ASSIGNMENT[np.searchsorted(CHANGES, time + 1e-9) - 1])


@pytest.fixture(scope="session")
def arena() -> World:
    """4 m by 3 m with a block of 1 m by 0.6 m."""
    return make_arena()


@pytest.fixture(scope="session")
def make_game() -> Callable[..., Game]:
    """A function that makes the known game: on which page, whether recorded, from which view."""

    def make(meshcat: Meshcat, *, recording: bool, view: Callable[[], View] = View) -> Game:
        world = make_arena()
        grown = [world_from_polygon(world.polygon.buffer(-RADIUS, join_style="mitre"))]
        builder = DiagramBuilder()
        scene = builder.AddNamedSystem(
            "scene",
            TrackingScene(
                world,
                grown,
                meshcat,
                pursuers=len(PURSUERS),
                evaders=len(EVADERS),
                robot_radius=RADIUS,
                publish_period=PERIOD,
                visibility_polygon=box_around,
                pursuit_field=eastward,
                recording=recording,
                view=view,
            ),
        )

        def connect(port: str, trajectory: PiecewisePolynomial) -> None:
            source = builder.AddNamedSystem(port, TrajectorySource(trajectory))
            builder.Connect(source.get_output_port(), scene.GetInputPort(port))

        for team, tracks in (("pursuer", PURSUERS), ("evader", EVADERS)):
            samples = np.array(tracks).transpose(0, 2, 1).reshape(-1, len(TIMES))
            path = PiecewisePolynomial.FirstOrderHold(TIMES, samples)
            connect(f"{team}_position", path)
            connect(f"{team}_direction", path.derivative())
        for port, values in (("visibility", VISIBILITY), ("assignment", ASSIGNMENT)):
            samples = np.array([*values, values[-1]], dtype=float).reshape(len(CHANGES) + 1, -1).T
            connect(port, PiecewisePolynomial.ZeroOrderHold([*CHANGES, END + 1.0], samples))
        return Game(builder.Build(), scene, meshcat)

    return make


@dataclass(frozen=True)
class Audit:
    """What outlines of bodies say about a game, from its log and its scenario alone.

    Attributes:
        gap: Least gap between two bodies at any moment, negative where they overlap [m].
        clearance: Least gap between a body and an obstacle or the outer wall [m].
        inside: Whether what every body swept from sample to sample is free space.
    """

    gap: float
    clearance: float
    inside: bool


def _audit(run) -> Audit:
    scenario = run.game.scenario
    teams = scenario.pursuers, scenario.evaders
    radii = np.concatenate([np.full(team.size, team.radius) for team in teams])
    tracks = np.concatenate([run.log["pursuer_position"], run.log["evader_position"]], axis=1)
    # Robots go straight from sample to sample.
    paths = shapely.linestrings(np.stack([tracks[:-1], tracks[1:]], axis=2))
    room = shapely.Polygon(scenario.world.boundary, scenario.world.obstacles)
    shapely.prepare(room)
    swept = shapely.buffer(paths, radii, quad_segs=8)
    first, second = np.triu_indices(len(radii), 1)
    # As one of two sees it, the other goes straight too.
    seen = tracks[:, first] - tracks[:, second]
    approaches = shapely.linestrings(np.stack([seen[:-1], seen[1:]], axis=2))
    gaps = shapely.distance(approaches, shapely.Point(0, 0)) - radii[first] - radii[second]
    clearances = shapely.distance(room.boundary, paths) - radii
    return Audit(gaps.min(), clearances.min(), bool(shapely.covers(room, swept).all()))


@pytest.fixture(scope="session")
def audit() -> Callable[..., Audit]:
    """A function of a TrackingRun that looks at the true outlines of bodies all the way."""
    return _audit


@pytest.fixture(scope="module")
def meshcat() -> Meshcat:
    """A Meshcat at a free port, for the tests of a module in turn."""
    return open_live_page(port=0)


class ScenePage:
    """Reads numbers off a page that shows the tracking scene. Paths are below "tracking"."""

    def __init__(self, watched) -> None:
        self.watched = watched
        self.page = watched.page
        self._marks = 0

    def open(self, url: str) -> None:
        """Load a page until it is connected, or has its animation."""
        self.page.goto(url)
        self.page.wait_for_function(
            "() => viewer.connection?.readyState === 1 || viewer.animator.actions.length > 0"
        )

    def settle(self, meshcat: Meshcat) -> None:
        """Wait until the page has heard all that Meshcat said so far."""
        self._marks += 1
        meshcat.SetProperty("mark", "position", [float(self._marks), 0.0, 0.0])
        self.page.wait_for_function(
            "mark => node('drake/mark')?.object.position.x === mark", arg=self._marks
        )

    def seek(self, time: float) -> None:
        """Put a replay at a time [s]."""
        self.watched.seek(time)

    def exists(self, path: str) -> bool:
        return self.page.evaluate("path => node(path) !== undefined", f"tracking/{path}")

    def shown(self, path: str) -> bool:
        """Whether a path is there and neither it nor a folder above it is hidden."""
        return self.page.evaluate("path => shown(path)", f"tracking/{path}")

    def shown_below(self, path: str) -> set[str]:
        """Names right below a path that are shown; none if there is no such path."""
        return set(
            self.page.evaluate(
                "path => Object.keys(node(path)?.children ?? {})"
                ".filter(name => name !== '<object>' && shown(path + '/' + name))",
                f"tracking/{path}",
            )
        )

    def matrix(self, path: str) -> np.ndarray:
        """From the coordinates of a path to the world's, shape (4, 4)."""
        elements = self.page.evaluate("path => matrix(path)", f"tracking/{path}")
        return np.array(elements).reshape(4, 4).T

    def position(self, path: str) -> np.ndarray:
        """Where the origin of a path is, seen from above, shape (2,) [m]."""
        return self.matrix(path)[:2, 3]

    def heading(self, path: str) -> float:
        """Direction of the x axis of a path [rad]."""
        matrix = self.matrix(path)
        return float(np.arctan2(matrix[1, 0], matrix[0, 0]))

    def vertices(self, path: str) -> np.ndarray:
        """Vertices of the mesh at a path, in the world, shape (n, 3) [m]."""
        flat = self.page.evaluate(
            """path => {
                const mesh = node(path + "/<object>").object;
                return Array.from(mesh.geometry.attributes.position.array);
            }""",
            f"tracking/{path}",
        )
        local = np.array(flat).reshape(-1, 3)
        return local @ self.matrix(path)[:3, :3].T + self.matrix(path)[:3, 3]

    def number(self, path: str) -> int | None:
        """The number that digits show, without its point; None if they show nothing."""
        places = [p for p in self.shown_below(path) if p.isdigit()]
        digits = {int(place): self.shown_below(f"{path}/{place}") for place in places}
        assert all(len(shown) <= 1 for shown in digits.values()), digits
        lit = {place: int(*shown) for place, shown in digits.items() if shown}
        return sum(digit * 10**place for place, digit in lit.items()) if lit else None


@pytest.fixture(scope="module")
def new_scene_page(new_page) -> Callable[..., ScenePage]:
    """A function that opens an address which shows the scene, with the network cut if asked."""

    def open_page(url: str, *, offline: bool = False) -> ScenePage:
        page = ScenePage(new_page())
        page.page.context.set_offline(offline)
        page.open(url)
        return page

    return open_page

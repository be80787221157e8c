"""A search through a social network, as a scenario file says it."""

import math
from dataclasses import dataclass, field
from typing import Annotated

from ...systems.numerics.checked import (
    Checked,
    Count,
    Duration,
    Finite,
    NonNegative,
    Positive,
    Speed,
    at_least,
    one_of,
)
from ...systems.numerics.errors import require
from ...systems.numerics.social.localisation.relative import METHODS as LOCALISATIONS
from ...systems.numerics.social.recognition.references import METHODS as FEATURES
from ..world_source import WorldSource

ORDERS = ("in_turn", "information")
POLICIES = ("wander", "rest")


def require_poses(name: str, poses: list[list[float]], count: int) -> None:
    """Refuse poses that are not [x, y, heading], or as many as neither `count` nor none.

    Args:
        name: Of the key, for the message.
        poses: What came [m], [m], [rad].
        count: How many there are to be.
    """
    require(len(poses) in (0, count), name, f"have {count} entries or none", len(poses))
    for pose in poses:
        sound = len(pose) == 3 and all(math.isfinite(value) for value in pose)
        require(sound, name, "be [x, y, heading], all finite", pose)


@dataclass(frozen=True, kw_only=True)
class MazeSource(Checked):
    """Walls and what hangs on them.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # The walls; null: the 8 ft x 8 ft maze of Zhang 2014, 2.3.4, with its landmarks.
    world: WorldSource | None = None
    # How many are hung as far from one another as walls allow, where the walls are given.
    landmarks: Annotated[int, at_least(1)] = 13
    # Side of a landmark [m].
    landmark_side: Positive = 0.26


@dataclass(frozen=True, kw_only=True)
class AgentCamera(Checked):
    """Of every common agent.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Size of a picture [px].
    width: int = 640
    height: int = 480
    # Horizontal angle of view [deg].
    view_angle: Finite = 65.0
    # Between pictures [s].
    period: Duration = 2.0
    # Standard deviation of a pixel's noise [gray levels of 255].
    noise: NonNegative = 3.0
    # Standard deviation of the blur [px].
    blur: NonNegative = 0.6

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("width", "height"):
            size = getattr(self, name)
            require(size >= 64, name, "be at least 64 pixels", size)
        require(0 < self.view_angle < 150, "view_angle", "lie in (0, 150) deg", self.view_angle)


@dataclass(frozen=True, kw_only=True)
class Crowd(Checked):
    """The people of the story: they walk about, take pictures and post them.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Probability of each, per iteration, of accepting a request (Table 2.4).
    friending: list[float]
    # Probability of each, per iteration, of ending a friendship (Table 2.4).
    unfriending: list[float]
    # Probability of each, per iteration, of saying no if it does not accept; empty: 0.2 for all.
    rejection: list[float] = field(default_factory=list)
    # Pairs of agents that know each other; with `persuasion`, friends in common help (4.4).
    acquaintances: list[list[int]] = field(default_factory=list)
    # Probability that a friend in common persuades an agent, per iteration.
    persuasion: float = 0.0
    # Speed [m/s].
    speed: Speed = 0.1
    # Where each starts, [x, y, heading] [m], [m], [rad]; empty: at random by the seed.
    poses: list[list[float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.friending)
        require(count > 0, "friending", "name an agent at least", self.friending)
        require(
            len(self.unfriending) == count,
            "unfriending",
            f"have {count} entries",
            self.unfriending,
        )
        require(
            len(self.rejection) in (0, count),
            "rejection",
            f"have {count} entries or none",
            self.rejection,
        )
        chances = [*self.friending, *self.unfriending, *self.rejection, self.persuasion]
        for name in ("friending", "unfriending", "rejection"):
            for i, chance in enumerate(getattr(self, name)):
                require(0 <= chance <= 1, f"{name}.{i}", "be a probability", chance)
        require(0 <= chances[-1] <= 1, "persuasion", "be a probability", self.persuasion)
        for i, pair in enumerate(self.acquaintances):
            known = len(pair) == 2 and pair[0] != pair[1] and set(pair) <= set(range(count))
            require(known, f"acquaintances.{i}", f"be two agents below {count}", pair)
        require_poses("poses", self.poses, count)

    @property
    def size(self) -> int:
        """Number of agents."""
        return len(self.friending)


@dataclass(frozen=True, kw_only=True)
class SoughtEvader(Checked):
    """Whom the pursuer looks for.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # What it does: "wander" as common agents do, or "rest".
    policy: Annotated[str, one_of(POLICIES)] = "wander"
    # Speed [m/s].
    speed: Speed = 0.06
    # Where it starts, [x, y, heading] [m], [m], [rad]; empty: at random by the seed.
    pose: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_poses("pose", [self.pose] if self.pose else [], 1)


@dataclass(frozen=True, kw_only=True)
class SearchingPursuer(Checked):
    """Who makes friends, reads their pictures, and goes to the evader.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Speed [m/s].
    speed: Speed = 0.2
    # What is left of its route where it waits for the next location [m].
    stand_off: NonNegative = 0.35
    # Where it starts, [x, y, heading] [m], [m], [rad]; empty: at random by the seed.
    pose: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_poses("pose", [self.pose] if self.pose else [], 1)


@dataclass(frozen=True, kw_only=True)
class SearchPolicy(Checked):
    """How friends are made and pictures read (Table 2.3).

    Raises:
        InvalidInput: A value is out of its range.
    """

    # N_req, most answers awaited at once.
    requests: Annotated[int, at_least(1)] = 3
    # T_wait, iterations without acceptance after which the next one gives up.
    patience: Annotated[int, at_least(0)] = 10
    # N_f, most friends; 0: as many as there are agents.
    friends: Annotated[int, at_least(0)] = 0
    # N_img, pictures of each friend in one look.
    pictures: Annotated[int, at_least(1)] = 1
    # Between iterations of Algorithms 2 and 3 [s].
    period: Duration = 2.0
    # Who is asked first: "in_turn", or those who promise most "information" (4.4).
    order: Annotated[str, one_of(ORDERS)] = "in_turn"
    # How features are found: "sift", "orb", or "surf" where OpenCV has it.
    method: Annotated[str, one_of(FEATURES)] = "sift"
    # How camera and evader are located: "thesis", "edges", "pnp", or "level", the surest.
    localisation: Annotated[str, one_of(LOCALISATIONS)] = "level"


@dataclass(frozen=True, kw_only=True)
class SocialScenario(Checked):
    """A pursuer without a camera finds an evader in its friends' pictures.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Where it takes place.
    maze: MazeSource = MazeSource()
    # Who takes pictures.
    agents: Crowd
    # Who is looked for.
    evader: SoughtEvader = SoughtEvader()
    # Who looks.
    pursuer: SearchingPursuer = SearchingPursuer()
    # What the pictures are taken with.
    camera: AgentCamera = AgentCamera()
    # How friends are made and pictures read.
    search: SearchPolicy = SearchPolicy()
    # Horizon [s].
    seconds: Duration = 120.0
    # Control period and time step, a millisecond at least [s].
    period: Duration = 0.05
    # Of everything random: starts, walks, answers, noise.
    seed: Count = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.period >= 1e-3, "period", "be 0.001 at least", self.period)
        for name, whole in (
            ("camera.period", self.camera.period),
            ("search.period", self.search.period),
        ):
            parts = whole / self.period
            require(
                abs(parts - round(parts)) < 1e-9 and round(parts) > 0,
                name,
                f"be a multiple of the period, which is {self.period}",
                whole,
            )

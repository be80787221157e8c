"""A search through a social network, as a scenario file says it."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

from pydantic import ConfigDict

from ...systems.numerics.errors import (
    require,
    require_finite,
    require_non_negative,
    require_one_of,
    require_positive,
)
from ...systems.numerics.social.localisation.relative import METHODS as LOCALISATIONS
from ...systems.numerics.social.recognition.references import METHODS as FEATURES
from ..scenario_files import NO_OTHER_KEYS
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
class MazeSource:
    """Walls and what hangs on them.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # The walls; null: the 8 ft x 8 ft maze of Zhang 2014, 2.3.4, with its landmarks.
    world: WorldSource | None = None
    # How many are hung as far from one another as walls allow, where the walls are given.
    landmarks: int = 13
    # Side of a landmark [m].
    landmark_side: float = 0.26

    def __post_init__(self) -> None:
        require(self.landmarks > 0, "landmarks", "be at least 1", self.landmarks)
        require_positive("landmark_side", self.landmark_side)


@dataclass(frozen=True, kw_only=True)
class AgentCamera:
    """Of every common agent.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # Size of a picture [px].
    width: int = 640
    height: int = 480
    # Horizontal angle of view [deg].
    view_angle: float = 65.0
    # Between pictures [s].
    period: float = 2.0
    # Standard deviation of a pixel's noise [gray levels of 255].
    noise: float = 3.0
    # Standard deviation of the blur [px].
    blur: float = 0.6

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = getattr(self, name)
            require(size >= 64, name, "be at least 64 pixels", size)
        require_finite("view_angle", self.view_angle)
        require(0 < self.view_angle < 150, "view_angle", "lie in (0, 150) deg", self.view_angle)
        require_positive("period", self.period)
        require_non_negative("noise", self.noise)
        require_non_negative("blur", self.blur)


@dataclass(frozen=True, kw_only=True)
class Crowd:
    """The people of the story: they walk about, take pictures and post them.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

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
    speed: float = 0.1
    # Where each starts, [x, y, heading] [m], [m], [rad]; empty: at random by the seed.
    poses: list[list[float]] = field(default_factory=list)

    def __post_init__(self) -> None:
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
        require_positive("speed", self.speed)
        require_poses("poses", self.poses, count)

    @property
    def size(self) -> int:
        """Number of agents."""
        return len(self.friending)


@dataclass(frozen=True, kw_only=True)
class SoughtEvader:
    """Whom the pursuer looks for.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # What it does: "wander" as common agents do, or "rest".
    policy: str = "wander"
    # Speed [m/s].
    speed: float = 0.06
    # Where it starts, [x, y, heading] [m], [m], [rad]; empty: at random by the seed.
    pose: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        require_one_of("policy", self.policy, POLICIES)
        require_positive("speed", self.speed)
        require_poses("pose", [self.pose] if self.pose else [], 1)


@dataclass(frozen=True, kw_only=True)
class SearchingPursuer:
    """Who makes friends, reads their pictures, and goes to the evader.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # Speed [m/s].
    speed: float = 0.2
    # What is left of its route where it waits for the next location [m].
    stand_off: float = 0.35
    # Where it starts, [x, y, heading] [m], [m], [rad]; empty: at random by the seed.
    pose: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        require_positive("speed", self.speed)
        require_non_negative("stand_off", self.stand_off)
        require_poses("pose", [self.pose] if self.pose else [], 1)


@dataclass(frozen=True, kw_only=True)
class SearchPolicy:
    """How friends are made and pictures read (Table 2.3).

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

    # N_req, most answers awaited at once.
    requests: int = 3
    # T_wait, iterations without acceptance after which the next one gives up.
    patience: int = 10
    # N_f, most friends; 0: as many as there are agents.
    friends: int = 0
    # N_img, pictures of each friend in one look.
    pictures: int = 1
    # Between iterations of Algorithms 2 and 3 [s].
    period: float = 2.0
    # Who is asked first: "in_turn", or those who promise most "information" (4.4).
    order: str = "in_turn"
    # How features are found: "sift", "orb", or "surf" where OpenCV has it.
    method: str = "sift"
    # How camera and evader are located: "thesis", "edges", "pnp", or "level", the surest.
    localisation: str = "level"

    def __post_init__(self) -> None:
        for name, least in (("requests", 1), ("patience", 0), ("friends", 0), ("pictures", 1)):
            value = getattr(self, name)
            require(value >= least, name, f"be at least {least}", value)
        require_positive("period", self.period)
        require_one_of("order", self.order, ORDERS)
        require_one_of("method", self.method, FEATURES)
        require_one_of("localisation", self.localisation, LOCALISATIONS)


@dataclass(frozen=True, kw_only=True)
class SocialScenario:
    """A pursuer without a camera finds an evader in its friends' pictures.

    Raises:
        InvalidInput: A value is out of its range.
    """

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS

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
    seconds: float = 120.0
    # Control period and time step, a millisecond at least [s].
    period: float = 0.05
    # Of everything random: starts, walks, answers, noise.
    seed: int = 0

    def __post_init__(self) -> None:
        require_positive("seconds", self.seconds)
        require_positive("period", self.period)
        require(self.period >= 1e-3, "period", "be 0.001 at least", self.period)
        require(self.seed >= 0, "seed", "be zero or positive", self.seed)
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

"""What a tracking run is made of: world, teams, strategy, clock."""

import math
from dataclasses import dataclass, field
from typing import Annotated

from ...systems.numerics.checked import (
    Checked,
    Count,
    Duration,
    NonNegative,
    Positive,
    Speed,
    one_of,
)
from ...systems.numerics.errors import require, require_finite, require_one_of
from ...systems.numerics.tracking.assignment.holding import HOLDS
from ...systems.numerics.tracking.assignment.rules import ASSIGNMENT_RULES
from ...systems.numerics.tracking.assignment.team_view import EXTRA_PURSUERS
from ...systems.numerics.tracking.assignment.voting import MOST_EVADERS
from ...systems.numerics.tracking.corner_policies import FIELDS
from ...systems.numerics.tracking.risk import RISK_FUNCTIONS, RISK_VECTORS
from ...systems.numerics.tracking.visibility_game.bottleneck import SWITCHES
from ..world_source import WorldSource

# The fields that are none: pursuers try their steps, or look them up in the solved game. By that
# they may be matched with evaders too.
LOOKAHEAD, GUARANTEE, CERTIFIED = "lookahead", "guarantee", "certified"

# Robots keep off one another as if their radii were larger by this share: wheels slip on a floor.
CLEARANCE = 0.05

# No floor has more in a team.
MOST_ROBOTS = 100

MODELS = ("point", "differential_drive")
# Evaders that look their moves up in the solved game, without and with the distance to losing.
OPTIMAL, OPTIMAL_DISTANCE = OPTIMAL_POLICIES = ("optimal", "optimal_distance")
POLICIES = (
    "adversarial",
    "best_response",
    *OPTIMAL_POLICIES,
    "waypoints",
    "random_walk",
    "you",
)


@dataclass(frozen=True, kw_only=True)
class RobotTeam(Checked):
    """A team of equal robots.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # "point" (2.1) or "differential_drive".
    model: Annotated[str, one_of(MODELS)] = "point"
    # Speed limit [m/s].
    top_speed: Speed
    # Turn-rate limit of differential drives [rad/s].
    top_turn_rate: Positive = 3.0
    # Turn rate per heading error of differential drives [1/s].
    heading_gain: Positive = 4.0
    # Radius of the robot's body: its centre keeps this distance from obstacles [m].
    radius: NonNegative = 0.0
    # Where each member starts, [x, y] [m]; empty: drawn at random by the seed.
    positions: list[list[float]] = field(default_factory=list)
    # Number of members, where positions are drawn at random.
    count: int = 0
    # Where each differential drive looks at the start [rad]; empty: east.
    headings: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.count % 1 == 0, "count", "be a whole number", self.count)
        require(self.count >= 0, "count", "be zero or positive", self.count)
        require(self.size <= MOST_ROBOTS, "count", f"be at most {MOST_ROBOTS}", self.size)
        for i, point in enumerate(self.positions):
            require(len(point) == 2, f"positions.{i}", "be [x, y]", point)
            for value in point:
                require_finite(f"positions.{i}", value)
        for i, heading in enumerate(self.headings):
            require_finite(f"headings.{i}", heading)
        named = len(self.positions)
        require(
            self.size > 0 and (not named or self.count in (0, named)),
            "positions",
            "name every member, or none beside a positive `count`",
            f"{named} positions and count {self.count}",
        )
        require(
            len(self.headings) in (0, self.size),
            "headings",
            f"have {self.size} entries or none",
            self.headings,
        )

    @property
    def size(self) -> int:
        """Number of members."""
        return len(self.positions) or self.count


@dataclass(frozen=True, kw_only=True)
class Pursuers(RobotTeam):
    """The team that keeps sight, and its strategy.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Who tracks whom: a name in RULES, or by the solved visibility game, "guarantee".
    assignment: Annotated[str, one_of(ASSIGNMENT_RULES, (GUARANTEE,))] = "hungarian"
    # When the team changes its mind: "none" asks the rule at every step, "until_lost" when a
    # pursuer has lost its evader or could be spared for one that nobody has, "cost" also when it
    # pays, "certificate" also when more can be guaranteed. Empty: "certificate" with "guarantee",
    # "until_lost" with the others.
    hold: str = ""
    # What pursuers beyond a matching do: "stay" or "riskiest".
    extra: Annotated[str, one_of(EXTRA_PURSUERS)] = "stay"
    # How far pursuers hear what others see; .inf: a centre knows all [m].
    radio_range: float = math.inf
    # Risk functions for the assignment, one for all or one each (2.13).
    risk_functions: list[str] = field(default_factory=lambda: ["total"])
    # Risk vectors for the pursuit field, one for all or one each (2.2).
    risk_vectors: list[str] = field(default_factory=lambda: ["proportional"])
    # How pursuers run: by the pursuit field of the corners, "margin", "table" or "table_up", or by
    # a look at what each step would bring, "lookahead", or by the solved visibility game:
    # "guarantee", or "certified", the lower bound's own policy, where nothing but walls blocks
    # sight. What certified pursuers want is not smoothed, and their drives turn before they drive.
    field: Annotated[str, one_of(FIELDS, (LOOKAHEAD, GUARANTEE, CERTIFIED))] = "margin"
    # Between the pursuers' nodes on which that game is solved, for "optimal" evaders too; a little
    # less for "certified", so that a step is a number of periods [m].
    grid: Positive = 0.1
    # The same for the game of one pursuer and two evaders, by which they play where they are fewer
    # than the evaders; halved it takes 64 times the memory [m].
    grid_of_two: Positive = 0.25
    # Time constant of the mean that pursuers take of their desired velocities, 0 for none [s]. On
    # the rim of a star region a field asks for to and fro in turns; the mean of that is steady.
    smoothing: NonNegative = 0.4
    # Allow several pursuers on one spot: alternatives that run side by side, as in Figure 2.6.
    alternatives: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        guaranteed = self.assignment == GUARANTEE
        require_one_of("hold", self.switch, SWITCHES if guaranteed else HOLDS)
        require(self.radio_range >= 0, "radio_range", "be zero or positive", self.radio_range)
        require(
            not guaranteed or math.isinf(self.radio_range),
            "radio_range",
            "be .inf with the assignment guarantee, which a centre makes",
            self.radio_range,
        )
        for name, chosen, known in (
            ("risk_functions", self.risk_functions, RISK_FUNCTIONS),
            ("risk_vectors", self.risk_vectors, RISK_VECTORS),
        ):
            require(len(chosen) in (1, self.size), name, f"have 1 or {self.size} entries", chosen)
            for each in chosen:
                require_one_of(name, each, known)

    @property
    def switch(self) -> str:
        """When the team changes its mind: `hold`, or what it is with this assignment."""
        if self.hold:
            return self.hold
        return "certificate" if self.assignment == GUARANTEE else "until_lost"


@dataclass(frozen=True, kw_only=True)
class Evaders(RobotTeam):
    """The team that is watched.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # One policy for all or one each: "adversarial", "best_response" (knows the pursuers' rule and
    # tries its plans against it), "optimal" and "optimal_distance" (know the solved visibility
    # game), "waypoints", "random_walk" or "you".
    policies: list[str] = field(default_factory=lambda: ["adversarial"])
    # Waypoints of each evader, [[x, y], ...] each [m]; only those with that policy use them.
    waypoints: list[list[list[float]]] = field(default_factory=list)
    # Time between the turns of a random walk [s].
    turn_period: Duration = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            len(self.policies) in (1, self.size),
            "policies",
            f"have 1 or {self.size} entries",
            self.policies,
        )
        for each in self.policies:
            require_one_of("policies", each, POLICIES)
        require(
            len(self.waypoints) in (0, self.size),
            "waypoints",
            f"have {self.size} entries or none",
            len(self.waypoints),
        )
        for j, path in enumerate(self.waypoints):
            for point in path:
                require(len(point) == 2, f"waypoints.{j}", "hold [x, y] points", point)
                for value in point:
                    require_finite(f"waypoints.{j}", value)
        for j, policy in enumerate(self.policy_of_each):
            has_path = bool(self.waypoints and self.waypoints[j])
            require(policy != "waypoints" or has_path, f"waypoints.{j}", "have a point", "none")
        require(
            self.policy_of_each.count("you") <= 1,
            "policies",
            "have you drive one evader at most",
            self.policies,
        )

    @property
    def policy_of_each(self) -> list[str]:
        """The policy of each evader."""
        return self.policies if len(self.policies) == self.size else self.policies * self.size


@dataclass(frozen=True, kw_only=True)
class TrackingScenario(Checked):
    """A game of sight: pursuers keep evaders in view among obstacles.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Where it takes place.
    world: WorldSource
    # The team that keeps sight.
    pursuers: Pursuers
    # The team that is watched.
    evaders: Evaders
    # Horizon [s].
    seconds: Duration = 60.0
    # Control period and time step, a millisecond at least [s].
    period: Duration = 0.05
    # Whether robots keep off one another by their radii; without, they are points in all but
    # their distance from walls, and pass through each other.
    bodies: bool = True
    # Whether a robot hides what is behind it; without, robots look over one another.
    bodies_block_sight: bool = False
    # Of everything random: starts, lots, walks.
    seed: Count = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.period >= 1e-3, "period", "be 0.001 at least", self.period)
        require(
            self.period <= self.seconds,
            "period",
            f"be at most `seconds`, which is {self.seconds}",
            self.period,
        )
        require(
            self.speed_ratio < 1,
            "evaders.top_speed",
            f"be below pursuers.top_speed, which is {self.pursuers.top_speed}",
            self.evaders.top_speed,
        )
        require(
            not (self.pursuers.alternatives and self.has_bodies),
            "bodies",
            "be false where pursuers are alternatives on one spot",
            self.bodies,
        )
        require(
            self.has_bodies or not self.bodies_block_sight,
            "bodies_block_sight",
            "be false where robots have no bodies",
            self.bodies_block_sight,
        )
        require(
            self.pursuers.field != CERTIFIED or not self.bodies_block_sight,
            "bodies_block_sight",
            f"be false where the field is {CERTIFIED}: a certificate knows of walls only",
            self.bodies_block_sight,
        )
        require(
            not self.pursuers.assignment.startswith("kemeny") or self.evaders.size <= MOST_EVADERS,
            "evaders",
            f"be at most {MOST_EVADERS} for {self.pursuers.assignment}",
            self.evaders.size,
        )

    @property
    def pursuer_radii(self) -> list[float] | None:
        """Radii at which pursuers and others keep off each other [m]; None without bodies."""
        return _kept_off(self.pursuers) if self.has_bodies else None

    @property
    def evader_radii(self) -> list[float] | None:
        """Radii at which evaders and others keep off each other [m]; None without bodies."""
        return _kept_off(self.evaders) if self.has_bodies else None

    @property
    def blocking_radii(self) -> list[float]:
        """Radii of the bodies that block sight, pursuers first [m]; empty where none does."""
        if not self.bodies_block_sight:
            return []
        pursuers, evaders = self.pursuers, self.evaders
        return [pursuers.radius] * pursuers.size + [evaders.radius] * evaders.size

    @property
    def has_bodies(self) -> bool:
        """Whether two robots can touch: points of radius zero cannot."""
        return self.bodies and self.pursuers.radius + self.evaders.radius > 0

    @property
    def speed_ratio(self) -> float:
        """The ratio a = v_e / v_p."""
        return self.evaders.top_speed / self.pursuers.top_speed


def _kept_off(team: RobotTeam) -> list[float]:
    """Radii of a team with their clearance [m]."""
    return [(1.0 + CLEARANCE) * team.radius] * team.size

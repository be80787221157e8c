"""What a run of tracking on pictures is made of: a tracking game, and its pursuers' cameras.

Before a run, cameras without a calibration are calibrated in simulation.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np

from ...systems.numerics.checked import Checked, Duration, Finite, NonNegative, Positive, one_of
from ...systems.numerics.errors import require, require_one_of, require_type
from ...systems.numerics.geometry.world import World
from ...systems.numerics.vision.estimation.calibration import (
    Calibration,
    calibrate,
    load_calibration,
)
from ...systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from ...systems.numerics.vision.estimation.range_models import MODELS
from ...systems.numerics.vision.estimation.shell_detection import chosen_colours
from ...systems.numerics.vision.omni_optics import OmniCamera
from ...systems.numerics.vision.sensor import Sensor
from ...systems.numerics.vision.surroundings import SHELL_COLOURS, Shell, Surroundings, shell_of
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.scenario import TrackingScenario

# What pursuers know of evaders: the cameras' estimates, or where they are.
SENSES = ("pictures", "truth")

# How pursuers look in each other's pictures: grey.
_PURSUER_COLOUR = (88, 90, 95)


@dataclass(frozen=True, kw_only=True)
class OmniOptics(OmniCamera):
    """The pursuers' cameras, all equal."""


@dataclass(frozen=True, kw_only=True)
class PictureQuality(Sensor):
    """The quality of their pictures; each camera adds its number to the seed."""


@dataclass(frozen=True, kw_only=True)
class PursuerVision(Checked):
    """How pursuers see, and the strategy that goes with it.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Weight w of (2.7): 1 for the pursuit field alone, 0 for the pull towards the evader alone.
    weight: Finite = 0.5
    # Distance from the evader to keep [m].
    stand_off: NonNegative = 0.45
    # The way over which the limit on closing in grows from there to the top speed [m].
    fade: Positive = 0.2
    # What pursuers know of evaders: "pictures" or "truth".
    senses: Annotated[str, one_of(SENSES)] = "pictures"
    # The evader that each pursuer trails, by number; empty: as pursuers.assignment says.
    targets: list[int] = field(default_factory=list)
    # The colour of each evader's shell, a name in SHELL_COLOURS, all different.
    colours: list[str]
    # Radius of the shells [m].
    shell_radius: Positive = Shell().radius
    # Between pictures [s].
    picture_period: Duration = 0.1
    # Height of the walls [m].
    wall_height: Positive = 0.5
    # Mirror and camera.
    optics: OmniOptics = OmniOptics()
    # Exposure, blur, noise, losses.
    quality: PictureQuality = PictureQuality()
    # How ranges are read: "exact" or "thesis".
    model: Annotated[str, one_of(MODELS)] = "exact"
    # Calibration file; empty: the cameras are calibrated in simulation before the run.
    calibration: str = ""
    # Distances to shells' near sides over which that is done, least and greatest [m].
    calibrated_range: list[float] = field(default_factory=lambda: [0.2, 4.0])

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0 <= self.weight <= 1, "weight", "lie in [0, 1]", self.weight)
        span = self.calibrated_range
        require(
            len(span) == 2 and 0 < span[0] < span[1],
            "calibrated_range",
            "be [least, greatest], both positive",
            span,
        )
        for j, colour in enumerate(self.colours):
            require_one_of(f"colours.{j}", colour, SHELL_COLOURS)
        different = len(set(self.colours)) == len(self.colours)
        require(different, "colours", "all be different", self.colours)

    @property
    def evader_shells(self) -> list[Shell]:
        """The shells that cameras look for."""
        return [shell_of(colour, radius=self.shell_radius) for colour in self.colours]

    @property
    def pursuer_shell(self) -> Shell:
        """What a pursuer looks like, from outside and in its own mirror."""
        return Shell(radius=0.1, top=0.18, colour=_PURSUER_COLOUR)


@dataclass(frozen=True, kw_only=True)
class PictureTrackingScenario(TrackingScenario):
    """A game of sight in which pursuers know of evaders only what their pictures show.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # How pursuers see.
    vision: PursuerVision

    def __post_init__(self) -> None:
        super().__post_init__()
        vision = self.vision
        require(
            self.pursuers.model == "differential_drive",
            "pursuers.model",
            "be differential_drive, for a camera needs a heading",
            self.pursuers.model,
        )
        require(
            len(vision.colours) == self.evaders.size,
            "vision.colours",
            f"have {self.evaders.size} entries, one per evader",
            vision.colours,
        )
        require(
            len(vision.targets) in (0, self.pursuers.size),
            "vision.targets",
            f"have {self.pursuers.size} entries or none",
            vision.targets,
        )
        for i, target in enumerate(vision.targets):
            require(
                0 <= target < self.evaders.size,
                f"vision.targets.{i}",
                f"lie in [0, {self.evaders.size})",
                target,
            )
        ticks = vision.picture_period / self.period
        require(
            abs(ticks - round(ticks)) < 1e-9 and ticks > 0.5,
            "vision.picture_period",
            f"be a multiple of `period`, which is {self.period}",
            vision.picture_period,
        )


# How many distances, in equal ratios, and directions.
_DISTANCES, _DIRECTIONS = 9, 5


def practise(vision: PursuerVision) -> Calibration:
    """Calibrate by the procedure of 2.2.4.2, on simulated pictures over the range that is asked.

    Args:
        vision: Whose cameras and shells.

    Raises:
        InvalidInput: Too few of the pictures show a shell.
    """
    near, far = vision.calibrated_range
    shell, colour = vision.evader_shells[0], vision.colours[0]
    return _practised(vision.optics, vision.quality, shell, near, far, colour)


# Runs of a sweep have the same cameras, and the pictures take seconds to read.
@lru_cache(maxsize=4)
def _practised(
    optics: OmniCamera, quality: Sensor, shell: Shell, near: float, far: float, colour: str
) -> Calibration:
    pictures = simulated_pictures(
        optics,
        quality,
        shell,
        distances=np.geomspace(near, far, _DISTANCES).tolist(),
        directions=_DIRECTIONS,
    )
    sizes = {"base": shell.base, "shell_radius": shell.radius, "shell_top": shell.top}
    readings, _ = read_pictures(pictures, optics, chosen_colours([colour])[0], **sizes)
    return calibrate(readings, camera=optics, **sizes)


@dataclass(frozen=True, eq=False)
class PictureGame:
    """A game ready to be played.

    Attributes:
        scenario: Where it comes from.
        tracking: World and teams, as `sightfield track` sets them up.
        surroundings: What cameras see of the world.
        calibration: Of the cameras, all equal.
    """

    scenario: PictureTrackingScenario
    tracking: TrackingGame
    surroundings: Surroundings
    calibration: Calibration

    @property
    def world(self) -> World:
        """Whose obstacles block sight."""
        return self.tracking.world

    @property
    def pursuer_regions(self) -> tuple[World, ...]:
        """Where pursuers' centres may be."""
        return self.tracking.pursuer_regions

    @property
    def evader_regions(self) -> tuple[World, ...]:
        """Where evaders' centres may be."""
        return self.tracking.evader_regions

    @property
    def pursuer_starts(self) -> np.ndarray:
        """Poses, shape (Np, 3) [m], [m], [rad]."""
        return self.tracking.pursuer_starts

    @property
    def evader_starts(self) -> np.ndarray:
        """Poses, shape (Ne, 3)."""
        return self.tracking.evader_starts


def set_up_picture_game(
    scenario: PictureTrackingScenario, calibration: Calibration | None = None
) -> PictureGame:
    """Place the teams and calibrate the cameras.

    Args:
        scenario: What is played.
        calibration: Of the cameras, where it is known already; else the scenario's file, or a
            calibration in simulation.

    Raises:
        InvalidInput: See `set_up_game` and `load_calibration`.
    """
    require_type("scenario", scenario, PictureTrackingScenario)
    vision = scenario.vision
    tracking = set_up_game(scenario)
    if calibration is None:
        calibration = (
            load_calibration(Path(vision.calibration)) if vision.calibration else practise(vision)
        )
    surroundings = Surroundings(world=tracking.world, wall_height=vision.wall_height)
    return PictureGame(scenario, tracking, surroundings, calibration)

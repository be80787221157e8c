"""A scenario of tracking on pictures made concrete: the game, and the calibrated cameras."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ....systems.numerics.geometry.world import World
from ....systems.numerics.vision.estimation.calibration import Calibration
from ....systems.numerics.vision.estimation.calibration_files import load_calibration
from ....systems.numerics.vision.surroundings import Surroundings
from ...tracking.game import TrackingGame, set_up_game
from .practice import practise
from .scenario import PictureTrackingScenario


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
    vision = scenario.vision
    tracking = set_up_game(scenario)
    if calibration is None:
        calibration = (
            load_calibration(Path(vision.calibration)) if vision.calibration else practise(vision)
        )
    surroundings = Surroundings(world=tracking.world, wall_height=vision.wall_height)
    return PictureGame(scenario, tracking, surroundings, calibration)

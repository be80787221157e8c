"""The weight w of (2.7) swept: how long sight is kept, and how good estimates are, at each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .picture_game import PictureGame, set_up_picture_game
from .run import run_picture_tracking
from .scenario import PictureTrackingScenario
from .summary import summarise_picture_tracking

# What is averaged over the seeds.
AVERAGED = ("tracking_time", "estimation_error_rms", "estimated_share", "mean_distance")


@dataclass(frozen=True, eq=False)
class WeightSweep:
    """Runs at several weights.

    Attributes:
        weights: Shape (k,).
        seeds: Shape (n,).
        values: Of each name in AVERAGED, shape (k, n) [s], [m], [1], [m]; NaN where there is none.
        censored: Whether sight was kept to the end of the run, so that its tracking time is only a
            lower bound, shape (k, n).
    """

    weights: np.ndarray
    seeds: np.ndarray
    values: dict[str, np.ndarray]
    censored: np.ndarray

    def table(self) -> list[dict[str, float | None]]:
        """A row of means over the seeds for each weight, ready for JSON.

        With censored runs, which it counts, a mean tracking time is a lower bound too.
        """
        rows = []
        for k, weight in enumerate(self.weights.tolist()):
            row: dict[str, float | None] = {"weight": weight}
            for name in AVERAGED:
                known = self.values[name][k][np.isfinite(self.values[name][k])]
                row[name] = float(known.mean()) if known.size else None
            row["censored_runs"] = int(self.censored[k].sum())
            rows.append(row)
        return rows


def sweep_weights(
    scenario: PictureTrackingScenario,
    weights: Sequence[float],
    seeds: Sequence[int],
    progress: Callable[[int], None] = lambda done: None,
) -> WeightSweep:
    """Play a scenario at every weight with every seed; the cameras are calibrated once.

    Args:
        scenario: What is played.
        weights: Of (2.7), each in [0, 1].
        seeds: Of the noise and of starts drawn at random.
        progress: Told the number of finished runs.

    Raises:
        InvalidInput: A weight is out of its range; see also `set_up_picture_game`.
    """
    variants = [
        [
            replace(scenario, seed=seed, vision=replace(scenario.vision, weight=weight))
            for seed in seeds
        ]
        for weight in weights
    ]
    values = {name: np.full((len(weights), len(seeds)), np.nan) for name in AVERAGED}
    censored = np.zeros((len(weights), len(seeds)), dtype=bool)
    game: PictureGame | None = None
    for k, row in enumerate(variants):
        for n, variant in enumerate(row):
            game = set_up_picture_game(variant, None if game is None else game.calibration)
            numbers = summarise_picture_tracking(run_picture_tracking(game), "")
            censored[k, n] = bool(numbers["censored"])
            for name in AVERAGED:
                value = numbers[name]
                if isinstance(value, float):
                    values[name][k, n] = value
            progress(k * len(seeds) + n + 1)
    return WeightSweep(np.array(weights, dtype=float), np.array(seeds, dtype=int), values, censored)

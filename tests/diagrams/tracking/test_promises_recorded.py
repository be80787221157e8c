"""Certificates, what is drawn of them, and what is found in logs of promises are as recorded."""

import math
from types import SimpleNamespace

import numpy as np

from sightfield.diagrams.tracking.promises import audit_promises


def made_up_run(seed):
    """A game of two pursuers and two evaders whose promises are drawn at random."""
    rng = np.random.default_rng(seed)
    times = 0.25 * np.arange(12)
    promised = rng.choice([0.0, 0.6, 1.4, 2.7, math.inf], (12, 2), p=[0.1, 0.3, 0.3, 0.2, 0.1])
    if seed % 3:
        # Promises that run down as time goes on, as far as they go.
        promised = np.maximum(rng.uniform(0.5, 4.0, 2) - times[:, None], 0.0)
    withdrawn = rng.random((12, 2)) < 0.12
    assignment = np.where(rng.random((12, 2)) < 0.06, -1, [0, 1])
    kept = np.where(withdrawn | (assignment < 0), 0.0, promised)
    return SimpleNamespace(
        times=times,
        tracking_time=float(rng.choice([1.3, 2.25, 2.75])),
        lost_evader=0 if rng.random() < 0.6 else None,
        log={
            "certificate": kept.min(axis=1, keepdims=True),
            "guaranteed_time": promised,
            "withdrawn": withdrawn,
            "assignment": assignment,
            "visibility": rng.random((12, 2, 2)) < 0.95,
        },
    )


def test_what_is_found_in_logs_is_as_recorded(as_recorded):
    as_recorded([audit_promises(made_up_run(seed)) for seed in range(60)])


def test_a_certified_game_is_as_recorded(as_it_was):
    settings = ("field=certified", "assignment=guarantee", "grid=0.5")
    words = [each for setting in settings for each in ("--set", f"pursuers.{setting}")]
    as_it_was("track", "corner_1v1", "--seconds", 0.6, *words)


def test_games_to_try_a_certificate_are_as_recorded(as_it_was):
    words = "corner_1v1 --certify --games 1 --set pursuers.grid=0.5 --set seconds=1.5"
    as_it_was("guarantee", *words.split())

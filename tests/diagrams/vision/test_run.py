"""Tracking on pictures alone, run for seconds."""

import numpy as np
import pytest

from sightfield.diagrams.vision.report import (
    PICTURE_UNITS,
    picture_log_arrays,
    summarise_picture_tracking,
)
from sightfield.diagrams.vision.run import run_picture_tracking


@pytest.mark.parametrize("name", ["omni_1v1", "omni_2v2"])
def test_pursuers_locate_their_evaders_to_centimetres_from_pictures_alone(picture_game, name):
    run = run_picture_tracking(picture_game(name, "seconds=1.5"))
    assert run.tracking.lost_evader is None
    assert run.tracking.tracking_time == pytest.approx(1.5)
    # Nothing is known before the first picture has been read, one control period after it.
    assert not run.known[run.tracking.times < 0.04].any()
    assert run.known[run.tracking.times > 0.06].all()
    assert np.nanmax(run.errors) < 0.04
    assert run.valid.any(axis=1).mean() > 0.9


def test_pursuers_go_to_their_evaders_on_pictures_as_on_the_truth(picture_game):
    ends = []
    for senses in ("pictures", "truth"):
        run = run_picture_tracking(picture_game("omni_1v1", "seconds=3", f"vision.senses={senses}"))
        log = run.tracking.log
        gaps = np.linalg.norm(log["pursuer_position"][:, 0] - log["evader_position"][:, 0], axis=1)
        assert gaps[-1] < 0.6 * gaps[0]
        ends.append(log["pursuer_position"][-1, 0])
    assert np.linalg.norm(ends[0] - ends[1]) < 0.1


def test_a_run_repeats_with_its_seed_and_differs_with_another(picture_game):
    runs = [
        run_picture_tracking(picture_game("omni_1v1", "seconds=0.6", f"seed={seed}"))
        for seed in (3, 3, 4)
    ]
    np.testing.assert_array_equal(runs[0].estimate, runs[1].estimate)
    assert (runs[0].estimate[-1] != runs[2].estimate[-1]).any()


def test_without_pictures_pursuers_know_nothing_and_stay(picture_game):
    run = run_picture_tracking(
        picture_game("omni_1v1", "seconds=0.6", "vision.quality.drop_share=1")
    )
    assert not run.known.any()
    assert not run.arrived.any()
    assert np.isnan(run.errors).all()
    track = run.tracking.log["pursuer_position"][:, 0]
    np.testing.assert_array_equal(track, np.broadcast_to(track[0], track.shape))
    summary = summarise_picture_tracking(run, "dark")
    assert summary["estimation_error_rms"] is None
    assert summary["mean_distance"] is None
    assert summary["pictures_lost_share"] == 1


def test_lost_pictures_are_bridged_by_what_is_remembered(picture_game):
    run = run_picture_tracking(
        picture_game("omni_1v1", "seconds=2", "vision.quality.drop_share=0.5")
    )
    assert 0.2 < summarise_picture_tracking(run, "")["pictures_lost_share"] < 0.8
    known = run.known[:, 0]
    # Once known, always known.
    assert known[np.argmax(known) :].all()
    assert np.nanmax(run.errors) < 0.1


def test_the_truth_has_no_error(picture_game):
    run = run_picture_tracking(picture_game("omni_2v2", "seconds=0.5", "vision.senses=truth"))
    assert summarise_picture_tracking(run, "")["estimation_error_worst"] == 0


def test_every_array_of_the_log_has_its_unit_and_its_samples(picture_game):
    run = run_picture_tracking(picture_game("omni_2v2", "seconds=0.3"))
    arrays = picture_log_arrays(run)
    assert set(arrays) == set(PICTURE_UNITS)
    assert {len(each) for each in arrays.values()} == {len(run.tracking.times)}

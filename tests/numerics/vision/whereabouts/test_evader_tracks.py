"""A tracker that cannot lose what it sees."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.vision.whereabouts.evader_tracks import (
    Picture,
    covariances_now,
    no_knowledge,
    positions_now,
    take_in,
)
from sightfield.systems.numerics.vision.whereabouts.occlusion_trial import run_occlusion_trial
from sightfield.systems.numerics.vision.whereabouts.reachable_set import may_be_at, members

FAR_AWAY = np.array([0.3, 0.3, 0.0])


def picture(time, spots, *, pose=FAR_AWAY, doubtful=False, spread=0.01):
    """What a picture says that measures shells at some spots; None where there is nothing."""
    positions = np.array([(np.nan, np.nan) if spot is None else spot for spot in spots])
    valid = np.array([spot is not None for spot in spots])
    covariances = np.where(valid[:, None, None], spread**2 * np.eye(2), np.diag([np.inf] * 2))
    return Picture(time, np.asarray(pose), positions, covariances, valid, ~valid & doubtful)


@pytest.mark.parametrize("rate", [5, 10, 20])
def test_a_runner_that_was_hidden_is_believed_when_it_is_seen_again(search_of, rate):
    search = search_of(0)
    known = no_knowledge(search)
    start, run = np.array([0.5, 2.5]), np.array([0.09, 0.0])
    believed = []
    for k in range(30 * rate):
        now = k / rate
        hidden = 8 < now < 25
        spot = None if hidden else start + now * run
        take_in(search, known, [picture(now, [spot], doubtful=hidden)], now)
        if not hidden:
            off = positions_now(search, known, now)[0] - start - now * run
            believed.append((now, np.hypot(*off) < 0.02))
        assert may_be_at(search.grid, known.sets[0], search.speed, now, *(start + now * run))
    assert all(good for _, good in believed)


def test_one_that_is_seen_where_it_cannot_be_is_believed_after_a_fifth_of_a_second(search_of):
    search = search_of(0)
    known = no_knowledge(search)
    for k in range(20):
        take_in(search, known, [picture(0.1 * k, [[0.5, 2.5]])], 0.1 * k)
    believed = []
    for k in range(20, 25):
        take_in(search, known, [picture(0.1 * k, [[3.5, 0.5]])], 0.1 * k)
        believed.append(positions_now(search, known, 0.1 * k)[0, 0] > 3)
    assert believed == [False, False, True, True, True]


def test_one_wild_picture_moves_nothing(search_of):
    search = search_of(0)
    known = no_knowledge(search)
    for k in range(40):
        spot = [3.5, 0.5] if k == 20 else [0.5, 2.5]
        take_in(search, known, [picture(0.1 * k, [spot])], 0.1 * k)
        off = positions_now(search, known, 0.1 * k)[0] - [0.5, 2.5]
        assert np.hypot(*off) < 0.01


def test_a_distant_camera_that_is_mistaken_does_not_overrule_one_beside_the_evader(search_of):
    search = search_of(0)
    known = no_knowledge(search)
    start, run = np.array([3.462, 1.0]), np.array([0.0, -0.085])
    for k in range(30):
        now, here = 0.1 * k, start + 0.1 * k * run
        pictures = [picture(now, [here], spread=4e-4)]
        if k == 20:
            # Unsure along its line of sight, and more to the side than it says.
            away = np.array([0.106, -0.097])
            along = away / np.hypot(*away)
            spread = 0.059**2 * np.outer(along, along) + 0.0046**2 * np.eye(2)
            far = picture(now, [here + away + [0.012, 0.013]])
            pictures.append(replace(far, covariances=spread[None]))
        take_in(search, known, pictures, now)
        assert np.hypot(*(positions_now(search, known, now)[0] - here)) < 5e-3


def test_between_pictures_and_without_them_an_estimate_moves_on(search_of):
    search = search_of(0)
    known = no_knowledge(search)
    run = np.array([0.05, -0.06])
    for k in range(30):
        take_in(search, known, [picture(0.1 * k, [[0.5, 2.5] + 0.1 * k * run])], 0.1 * k)
    # It is filmed on and on, but gives no estimate.
    for k in range(30, 34):
        take_in(search, known, [picture(0.1 * k, [None], doubtful=True)], 0.1 * k)
        for now in (0.1 * k, 0.1 * k + 0.05):
            expected = [0.5, 2.5] + now * run
            np.testing.assert_allclose(positions_now(search, known, now)[0], expected, atol=2e-3)


def test_late_and_early_pictures_tell_the_same(search_of):
    search = search_of(0)
    run = np.array([0.06, 0.02])
    ends = []
    for delay in (0.0, 0.15):
        known = no_knowledge(search)
        for k in range(41):
            now = 0.1 * k
            spots = [(now, 0.0), (now - delay, 0.0)]
            due = [picture(at, [[0.5, 0.5] + at * run]) for at, _ in spots if at >= 0]
            take_in(search, known, due, now)
        ends.append(positions_now(search, known, 4.0)[0])
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-3)
    np.testing.assert_allclose(ends[1], [0.5, 0.5] + 4.0 * run, atol=1e-3)


def test_unseen_its_set_grows_and_where_a_camera_looks_it_shrinks(search_of):
    search = search_of(0)
    known = no_knowledge(search)
    for time in (-0.1, 0.0):
        take_in(search, known, [picture(time, [[2.0, 2.6]])], time)
    sizes = []
    for k in range(1, 101):
        looks = [picture(0.1 * k, [None], pose=[3.5, 2.6, 0.0])] if k == 100 else []
        take_in(search, known, looks, 0.1 * k)
        sizes.append(members(known.sets[0], 0.1 * k).sum())
    assert (np.diff(sizes[:99]) >= 0).all()
    assert sizes[98] > 50 * sizes[0]
    assert sizes[99] < 0.5 * sizes[98]
    # The estimate is where it may be, and as unsure as the set is wide.
    place = positions_now(search, known, 10.0)
    assert may_be_at(search.grid, known.sets[0], search.speed, 10.0, *place[0])
    spread = covariances_now(search, known, place, 10.0)[0]
    assert 1e-4 < np.linalg.eigvalsh(spread)[0] < np.linalg.eigvalsh(spread)[1] < 1.0


def test_identical_shells_have_a_track_each_whatever_order_they_come_in(search_of):
    search = search_of(0, 0)
    known = no_knowledge(search)
    rng = np.random.default_rng(0)
    for k in range(60):
        now = 0.1 * k
        spots = np.array([[0.5 + 0.08 * now, 0.45], [1.0 - 0.08 * now, 0.5]])
        order = rng.permutation(2)
        take_in(search, known, [picture(now, spots[order], spread=0.005)], now)
        places = positions_now(search, known, now)
        off = np.linalg.norm(places[:, None] - spots, axis=2)
        assert min(off[[0, 1], [0, 1]].max(), off[[0, 1], [1, 0]].max()) < 0.03


def test_memory_is_bounded_whatever_is_seen(search_of):
    search = search_of(0)
    known = no_knowledge(search)
    sizes = [each.shape for each in (known.tracks, known.hypotheses, known.sets)]
    rng = np.random.default_rng(1)
    places = search.grid.places[search.grid.usable]
    for k in range(60):
        take_in(search, known, [picture(0.1 * k, [places[rng.integers(len(places))]])], 0.1 * k)
    assert [each.shape for each in (known.tracks, known.hypotheses, known.sets)] == sizes
    assert np.isfinite(positions_now(search, known, 6.0)).all()


@pytest.mark.parametrize("evaders", [1, 2])
def test_a_few_occlusions_lose_nobody(search_of, evaders):
    search = search_of(*[0] * evaders)
    trials = [
        run_occlusion_trial(
            search, cameras=evaders, rate=10.0, seconds=60.0, camera_speed=0.3, seed=seed
        )
        for seed in range(3)
    ]
    found = np.concatenate([each.reacquired for each in trials])
    found = found[~np.isnan(found)]
    assert len(found) > 3
    assert (found <= 0.5).all()
    assert min(each.inside for each in trials) > 0.98
    assert max(each.excess for each in trials) < 1e-6
    if evaders == 2:
        assert np.nanmean([each.apart for each in trials]) > 0.95

"""Trials of a search for evaders behind walls, with simulated detections instead of pictures.

Pursuers drive about at random and film; evaders run, stop and turn. What a camera reports of an
evader follows from how much of its shell is in sight: one in full view is measured, but for a few
that are refused or overlooked; one partly in view is measured, refused or overlooked; one out of
view is not reported. Now and then there is a false detection. Pictures come late, each camera's by
its own delay, and some are lost.
"""

from dataclasses import dataclass

import numpy as np

from ...geometry.edge_index import EdgeIndex
from ...geometry.segment_sight import segment_is_clear
from .evader_tracks import Picture, Search, no_knowledge, positions_now, take_in
from .reachable_set import may_be_at, members

# Shares of the pictures of a shell in full view that are refused, and that show nothing; of
# pictures that are lost; of pictures with a shell too many.
_REFUSED, _OVERLOOKED, _LOST, _FALSE = 0.02, 0.002, 0.1, 0.01
# Standard deviations: across as an angle [rad], along as a length [m] and per squared metre [1/m].
_ACROSS, _ALONG, _ALONG_FAR = 0.004, 0.003, 0.004
# Greatest delay of a camera [s], and its share of the picture's period.
_DELAY = 0.2
_STEP = 0.05
# An estimate this near to the evader has found it [m].
_FOUND = 0.1


@dataclass(frozen=True, eq=False)
class OcclusionTrial:
    """What came of one trial.

    Attributes:
        hidden: How long each occlusion lasted, shape (n,) [s].
        reacquired: Time from when each evader was seen again until an estimate was near it, shape
            (n,) [s]; infinite if none was while it was seen; NaN if it vanished within a second.
        inside: Share of the time at which an evader was in its set.
        excess: How far a set reached beyond the disc that the evader could have reached, at most
            [m]; not positive if never.
        apart: Share of the time at which evaders that were all in view had an estimate each; NaN
            without such times or with one evader.
    """

    hidden: np.ndarray
    reacquired: np.ndarray
    inside: float
    excess: float
    apart: float


def run_occlusion_trial(
    search: Search, *, cameras: int, rate: float, seconds: float, camera_speed: float, seed: int
) -> OcclusionTrial:
    """Let evaders be searched for.

    Args:
        search: What is searched for; every evader of it has the same colour.
        cameras: Number of pursuers.
        rate: Of pictures of each camera [1/s].
        seconds: How long [s].
        camera_speed: Of the pursuers [m/s].
        seed: Of all that is random.
    """
    rng = np.random.default_rng(seed)
    evaders = len(search.colours)
    knowledge = no_knowledge(search)
    walkers = [_Walker(search, search.speed, rng) for _ in range(evaders)]
    pursuers = [_Walker(search, camera_speed, rng) for _ in range(cameras)]
    delays = rng.uniform(0.0, min(_DELAY, 0.9 / rate), cameras)
    waiting: list[tuple[float, Picture]] = []
    taken = np.floor(-rng.random(cameras))
    seen_at = np.full(evaders, -np.inf)
    seen_since, gone = np.full(evaders, np.nan), np.full(evaders, np.nan)
    hidden, reacquired, inside, apart, excess = [], [], [], [], -np.inf
    for step in range(round(seconds / _STEP)):
        now = step * _STEP
        truth = np.array([each.walk(now) for each in walkers])
        stands = np.array([each.walk(now) for each in pursuers])
        for i, stand in enumerate(stands):
            if np.floor(now * rate + 1e-9) > taken[i]:
                taken[i] = np.floor(now * rate + 1e-9)
                if rng.random() > _LOST:
                    waiting.append((now + delays[i], _film(search, now, stand, truth, rng)))
        due = [each for at, each in waiting if at <= now + 1e-9]
        waiting = [each for each in waiting if each[0] > now + 1e-9]
        take_in(search, knowledge, due, now)
        estimates = positions_now(search, knowledge, now)
        off = np.linalg.norm(estimates[:, None] - truth, axis=2)
        near = np.nan_to_num(off, nan=np.inf)
        for j in range(evaders):
            last = [each.time for each in due if _measures(each, truth[j], search)]
            if last:
                if now - seen_at[j] > max(0.6, 2.5 / rate) and np.isfinite(seen_at[j]):
                    gone[j], seen_since[j] = min(last) - seen_at[j], now
                seen_at[j] = max(*last, seen_at[j])
            if not np.isnan(seen_since[j]):
                passed = now - seen_since[j]
                if near[:, j].min() < _FOUND:
                    hidden.append(gone[j])
                    reacquired.append(passed)
                    seen_since[j] = np.nan
                elif now - seen_at[j] > max(0.5, 2.5 / rate):
                    hidden.append(gone[j])
                    reacquired.append(np.nan if passed < 1.0 else np.inf)
                    seen_since[j] = np.nan
            # With identical shells an evader may be in the set of the other.
            if np.isfinite(seen_at).all():
                spot = truth[j]
                inside.append(
                    any(may_be_at(search.grid, r, search.speed, now, *spot) for r in knowledge.sets)
                )
        if evaders == 1 and np.isfinite(seen_at[0]):
            excess = max(excess, _excess(search, knowledge.sets[0], knowledge.tracks[0], now))
        if evaders == 2 and (now - seen_at < max(0.3, 1.5 / rate)).all():
            apart.append(min(max(off[0, 0], off[1, 1]), max(off[0, 1], off[1, 0])) < _FOUND)
    return OcclusionTrial(
        hidden=np.array(hidden),
        reacquired=np.array(reacquired),
        inside=float(np.mean(inside)) if inside else np.nan,
        excess=float(excess),
        apart=float(np.mean(apart)) if apart else np.nan,
    )


class _Walker:
    """One that runs straight ahead, stops, and turns, at random moments and at walls."""

    def __init__(self, search: Search, speed: float, rng: np.random.Generator):
        self._index: EdgeIndex = search.grid.edges
        places = search.grid.places[search.grid.usable]
        self._spot, self._speed, self._rng = places[rng.integers(len(places))], speed, rng
        self._velocity, self._until = np.zeros(2), 0.0

    def walk(self, now: float) -> np.ndarray:
        """Go one step and say where it ends, shape (2,) [m]."""
        for _ in range(20):
            ahead = self._spot + _STEP * self._velocity
            if now < self._until and segment_is_clear(self._index, *self._spot, *ahead):
                self._spot = ahead
                break
            heading = self._rng.uniform(-np.pi, np.pi)
            # A fifth of the legs is a stop, two fifths are at top speed.
            pace = self._speed * min(max(self._rng.uniform(-0.2, 1.4), 0.0), 1.0)
            self._velocity = pace * np.array([np.cos(heading), np.sin(heading)])
            self._until = now + self._rng.uniform(0.5, 15.0)
        return self._spot.copy()


def _film(
    search: Search, now: float, stand: np.ndarray, truth: np.ndarray, rng: np.random.Generator
) -> Picture:
    """The detections that a picture would give."""
    count = len(truth)
    positions, spreads = np.full((count, 2), np.nan), np.tile(np.diag([np.inf] * 2), (count, 1, 1))
    valid, doubtful = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    order = rng.permutation(count)
    for k, spot in zip(order, truth, strict=True):
        share = _share_in_sight(search, stand, spot, np.delete(truth, int(k), axis=0))
        chance = rng.random()
        if share == 1.0:
            doubtful[k] = chance < _REFUSED
            measured = chance >= _REFUSED + _OVERLOOKED
        else:
            doubtful[k] = share > 0 and chance < 0.5
            measured = share > 0.5 and chance > 0.7
        if not measured and rng.random() < _FALSE:
            places = search.grid.places[search.grid.usable]
            spot, measured = places[rng.integers(len(places))], True
        if measured:
            positions[k], spreads[k] = _measure(stand, spot, rng)
            valid[k] = True
    pose = np.array([*stand, 0.0])
    return Picture(now, pose, positions, spreads, valid, doubtful)


def _measure(
    stand: np.ndarray, spot: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    offset = spot - stand
    away = float(np.hypot(*offset)) + 1e-9
    along = offset / away
    axes = np.column_stack([along, [-along[1], along[0]]])
    deviations = np.array([_ALONG + _ALONG_FAR * away**2, _ACROSS * away + 0.001])
    spread = axes @ np.diag(deviations**2) @ axes.T
    return spot + axes @ (deviations * rng.standard_normal(2)), spread


def _share_in_sight(
    search: Search, stand: np.ndarray, spot: np.ndarray, others: np.ndarray
) -> float:
    """Share of a shell that a camera sees, of its two sides and its middle."""
    offset = spot - stand
    away = float(np.hypot(*offset))
    near, far = search.certain_range
    if not near <= away <= far:
        return 0.0
    aside = search.shell_radius / away * np.array([-offset[1], offset[0]])
    sights = [segment_is_clear(search.walls, *stand, *(spot + s * aside)) for s in (-1, 0, 1)]
    for other in others:
        if np.allclose(other, spot):
            continue
        along = float((other - stand) @ offset) / away
        across = abs(float((other - stand) @ aside)) / search.shell_radius
        if 0 < along < away and across < 2 * search.shell_radius:
            sights = [False, sights[1] and across > search.shell_radius, False]
    return float(np.mean(sights))


def _measures(picture: Picture, spot: np.ndarray, search: Search) -> bool:
    """Whether a picture has a measurement of what is here now."""
    off = np.linalg.norm(picture.positions[picture.valid] - spot, axis=1)
    return bool((off < _FOUND + search.speed * _DELAY).any())


def _excess(search: Search, reach: np.ndarray, row: np.ndarray, now: float) -> float:
    """How far a set reaches beyond the disc in which it began, grown at top speed [m]."""
    places = search.grid.places[members(reach, now)]
    away = np.linalg.norm(places - row[1:3], axis=1)
    # The cell that holds the centre counts as one, however small the disc.
    away = away[away > 1.4143 * search.grid.cell]
    if np.isinf(row[3]) or len(away) == 0:
        return -np.inf
    return float(away.max() - search.speed * (now - row[3]))

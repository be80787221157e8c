"""Machines that drive late, stop, and keep the order of a timetable; distances by Shapely."""

import numpy as np
import shapely

from sightfield.systems.numerics.harvest.timing.keep_order import holds_now

STEP = 0.25


def drive_disturbed(journeys, timetable, rng, patience=20_000.0):
    """Speeds off by up to 20% and stops of up to 120 s; stations at all times, shape (T, N) [m]."""
    count = len(journeys)
    lengths = np.array([journey.path.length for journey in journeys])
    factor = rng.uniform(0.8, 1.2, count)
    stops = [np.sort(rng.uniform(0, length, rng.integers(0, 4))) for length in lengths]
    stands = np.zeros(count)
    at, speed = np.zeros(count), np.zeros(count)
    rate = np.array([journey.acceleration for journey in journeys])
    top = np.array([float(journey.limits) for journey in journeys])
    log = [at.copy()]
    holds = holds_now(timetable, at)
    while (at < lengths - 0.01).any():
        assert len(log) * STEP < patience, f"not finished: {at} of {lengths}"
        if len(log) % 400 == 0:
            factor = rng.uniform(0.8, 1.2, count)
        for m in range(count):
            if len(stops[m]) and at[m] > stops[m][0]:
                stands[m] = rng.uniform(0, 120)
                stops[m] = stops[m][1:]
        after = holds_now(timetable, at)
        assert (after >= holds).all(), "a hold moved back"
        holds = after
        # The largest speed after the step from which the machine can stand at its hold.
        way = np.maximum(np.minimum(holds, lengths) - at - speed * STEP / 2, 0.0)
        brake = np.sqrt(2 * rate * way + (rate * STEP / 2) ** 2) - rate * STEP / 2
        wanted = np.where(stands > 0, 0.0, top * factor)
        wanted = np.minimum(wanted, np.maximum(brake, 0.0))
        new = np.clip(wanted, speed - rate * STEP, speed + rate * STEP)
        new = np.maximum(new, 0.0)
        step = (speed + new) / 2 * STEP
        # What is left of a few millimetres is driven at a crawl.
        crawl = (new < 0.05) & (stands <= 0)
        step = np.where(crawl, np.minimum(np.maximum(holds - at, 0.0), 0.02), step)
        at, speed = at + step, new
        stands = np.maximum(stands - STEP, 0.0)
        log.append(at.copy())
    return np.array(log)


def outlines_at(path, outline, stations):
    """Parts of a machine at stations, shape (parts, T) of Shapely polygons."""
    x, y, theta = path.pose_at(stations).T
    c, s = np.cos(theta), np.sin(theta)
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    place = np.column_stack([x, y])[:, None]
    return np.array(
        [shapely.polygons(np.einsum("tij,cj->tci", turn, part) + place) for part in outline]
    )


def least_distance(journeys, outline, log):
    """Least distance of any two machines at any of the times [m]."""
    shapes = [
        outlines_at(journey.path, outline, log[:, m]) for m, journey in enumerate(journeys)
    ]
    reach = max(np.hypot(*part.T).max() for part in outline)
    places = [journey.path.pose_at(log[:, m])[:, :2] for m, journey in enumerate(journeys)]
    least = np.inf
    for m in range(len(journeys)):
        for n in range(m):
            near = np.hypot(*(places[m] - places[n]).T) < 2 * reach + 2
            for one in shapes[m]:
                for other in shapes[n]:
                    apart = shapely.distance(one[near], other[near])
                    least = min(least, apart.min(initial=np.inf))
    return least

"""The audit: checks what machines and grain did, by their log, against what they may do.

It knows nothing of plans, drivers or simulators: it reads poses, outlines, ground and grain.
"""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...errors import require_positive
from .crop import CropRecord, Ground, crop_record, edges_of, ground_of
from .harvest_log import AuditFault, HarvestLog, Site, faults_where, spells
from .motion import MovingOutline, machines_in_motion, motion_faults, polygons_at
from .nearness import Nearness, nearness, nearness_to_edges

# Tolerance of grain balances that are exact but for rounding [kg].
EXACT = 1e-6

# Tolerance between all grain and that of the area cut, the larger of two: a part of all grain, or
# the grain of so much area [m^2].
PART, AREA = 0.02, 100.0

# Least distance between the outlines of two machines [m].
GAP = 0.3

# Largest part of the crop that bodies may drive over while it stands.
CRUSHED = 0.002


def grain_faults(
    log: HarvestLog, site: Site, crop: CropRecord
) -> tuple[dict[str, float | None], list[AuditFault]]:
    """Check the balance of all grain.

    No machine may hold less than nothing or more than its capacity. Neither what is delivered nor
    all grain together may decrease. All grain may increase only while a header is down, and has to
    match the area cut, by the yield that is stated or else by the mean yield of the log.

    Returns:
        Figures by name and faults.
    """
    time = log.time
    faults: list[AuditFault] = []

    def look(kind: str, machines: tuple[str, ...], beyond: np.ndarray, limit: float) -> None:
        faults.extend(faults_where(kind, machines, beyond, limit, "kg", time, at_end=True))

    for group, held, machines in (
        ("combine", log.tank, site.combines),
        ("cart", log.cart_load, site.carts),
    ):
        for i, machine in enumerate(machines):
            worst = np.maximum(held[:-1, i], held[1:, i])
            least = np.minimum(held[:-1, i], held[1:, i])
            look("more grain than it holds", (f"{group} {i}",), worst, machine.capacity + EXACT)
            look("less than no grain", (f"{group} {i}",), -least, EXACT)
    grain = log.tank.sum(axis=1) + log.cart_load.sum(axis=1) + log.delivered
    comes = np.diff(grain)
    look("grain is taken back", (), -np.diff(log.delivered), EXACT)
    look("grain is lost", (), -comes, EXACT)
    down = (log.cutting[:-1] > 0) | (log.cutting[1:] > 0)
    look("grain from nowhere", (), np.where(down.any(axis=1), 0.0, comes), EXACT)
    harvested = float(grain[-1] - grain[0])
    area = float(crop.cut[-1])
    stated = not math.isnan(site.density)
    density = site.density if stated else harvested / area if area > 0 else 0.0
    comes_of_crop = density * crop.cut
    if crop.grain is not None:
        comes_of_crop = crop.grain
        density = float(crop.grain[-1]) / area if area > 0 else 0.0
    off = np.abs(grain - grain[0] - comes_of_crop)
    most = max(PART * abs(harvested), AREA * density) + EXACT
    look("grain differs from the area cut", (), np.maximum(off[:-1], off[1:]), most)
    return {
        "grain_harvested": harvested,
        "grain_delivered": float(log.delivered[-1] - log.delivered[0]),
        "grain_left": float(log.tank[-1].sum() + log.cart_load[-1].sum()),
        "grain_error": float(max(0.0, -comes.min())),
    }, faults


@dataclass(frozen=True, eq=False)
class HarvestAudit:
    """Result of an audit.

    Attributes:
        figures: duration [s], combines, carts, field_area [m^2], min_combine_to_combine,
            min_cart_to_combine, min_cart_to_cart, min_to_obstacle [m] (to 1 mm; None where there is
            no such pair or no obstacle), beyond_margin [m^2] (largest area of one outline at one
            time), crop_under_bodies [m^2], coverage (part of the crop that was cut),
            combine_acceleration, combine_lateral_acceleration, cart_acceleration,
            cart_lateral_acceleration [m/s^2], grain_harvested, grain_delivered, grain_left (in
            tanks and carts at the end), grain_error (most that vanished between two samples) [kg].
        faults: What is wrong, in the order of their kinds and times.
    """

    figures: dict[str, float | int | None]
    faults: tuple[AuditFault, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults


def audit_harvest(log: HarvestLog, site: Site, gap: float = GAP) -> HarvestAudit:
    """Audit a log.

    Args:
        log: What machines did.
        site: Their outlines and limits, and the field.
        gap: Least distance between the outlines of two machines, always [m].

    Raises:
        InvalidInput: The gap is not positive.
    """
    require_positive("gap", gap)
    ground = ground_of(site)
    moving = machines_in_motion(log, site)
    distances, faults = _machines(moving, log.time, gap)
    obstacle, beyond, off_ground = _off_ground(moving, log.time, ground)
    crop = crop_record(log, site, ground.crop)
    accelerations, impossible = motion_faults(log, site)
    grain, misplaced = grain_faults(log, site, crop)
    crushed = sum(float(each.sum()) for each in crop.crushed.values())
    figures: dict[str, float | int | None] = {
        "duration": float(log.time[-1] - log.time[0]),
        "combines": len(site.combines),
        "carts": len(site.carts),
        "field_area": crop.area,
        **distances,
        "min_to_obstacle": obstacle,
        "beyond_margin": beyond,
        "crop_under_bodies": crushed,
        "coverage": float(crop.cut[-1]) / crop.area,
        **accelerations,
        **grain,
    }
    most = CRUSHED * crop.area
    trodden = [
        _trodden(name, each, log.time, most)
        for name, each in crop.crushed.items()
        if crushed > most and each.any()
    ]
    return HarvestAudit(figures, (*faults, *off_ground, *trodden, *impossible, *misplaced))


def _trodden(name: str, crushed: np.ndarray, time: np.ndarray, limit: float) -> AuditFault:
    where = np.flatnonzero(crushed)
    first, last = int(where[0]), int(where[-1])
    worst = float(time[int(np.argmax(crushed))])
    amount = float(crushed.sum())
    begin, end = float(time[first]), float(time[last + 1])
    return AuditFault("crop under bodies", (name,), begin, end, worst, amount, limit, "m^2")


def _machines(
    moving: dict[str, list[MovingOutline]], time: np.ndarray, gap: float
) -> tuple[dict[str, float | None], list[AuditFault]]:
    """Least distances by kinds of machines, and a fault wherever two machines are too near."""
    best = {
        "min_combine_to_combine": math.inf,
        "min_cart_to_combine": math.inf,
        "min_cart_to_cart": math.inf,
    }
    names = {
        frozenset(["combine"]): "min_combine_to_combine",
        frozenset(["cart"]): "min_cart_to_cart",
        frozenset(["cart", "combine"]): "min_cart_to_combine",
    }
    faults: list[AuditFault] = []
    for one, other in combinations(moving, 2):
        kind = names[frozenset([one.split()[0], other.split()[0]])]
        found: list[Nearness] = []
        for a in moving[one]:
            for b in moving[other]:
                found.append(nearness(a, b, gap, best[kind]))
                best[kind] = min(best[kind], found[-1].nearest)
        least, share = _nearest(found)
        for first, last in spells(least < gap, time):
            faults.append(_too_near(moving, (one, other), least, share, first, last, time, gap))
    return {name: each if math.isfinite(each) else None for name, each in best.items()}, faults


def _nearest(found: list[Nearness]) -> tuple[np.ndarray, np.ndarray]:
    """Least of several distances in each interval between samples, and when; (T - 1,) each."""
    all_least = np.stack([each.least for each in found])
    which = np.argmin(all_least, axis=0)
    at = np.arange(all_least.shape[1])
    return all_least[which, at], np.stack([each.share for each in found])[which, at]


def _too_near(
    moving: dict[str, list[MovingOutline]],
    who: tuple[str, str],
    least: np.ndarray,
    share: np.ndarray,
    first: int,
    last: int,
    time: np.ndarray,
    gap: float,
) -> AuditFault:
    # It takes so many arguments to describe two machines and a spell of a log.
    begin, end = float(time[first]), float(time[last])
    worst = first + int(np.argmin(least[first:last]))
    if least[worst] > 0:
        at = _moment(time, worst, share[worst])
        return AuditFault("machines too near", who, begin, end, at, float(least[worst]), gap, "m")
    numbers, shares = _looks(share, first, last)
    one, other = (
        np.array([shapely.union_all(both) for both in zip(*polygons, strict=True)])
        for polygons in ([polygons_at(o, numbers, shares) for o in moving[name]] for name in who)
    )
    areas = shapely.area(shapely.intersection(one, other))
    k = int(np.argmax(areas))
    at = _moment(time, numbers[k], shares[k])
    return AuditFault("machines overlap", who, begin, end, at, float(areas[k]), 0.0, "m^2")


def _looks(share: np.ndarray, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Samples of a spell and the worst instants between them, as arrays of numbers and shares."""
    numbers = np.arange(first, last)
    begins = np.zeros(len(numbers))
    return (
        np.concatenate([numbers, numbers, numbers[-1:]]),
        np.concatenate([begins, share[first:last], [1.0]]),
    )


def _moment(time: np.ndarray, number: int, share: float) -> float:
    return float(time[number] + share * (time[number + 1] - time[number]))


def _off_ground(
    moving: dict[str, list[MovingOutline]], time: np.ndarray, ground: Ground
) -> tuple[float | None, float, list[AuditFault]]:
    """Least distance to an obstacle, largest area beyond the margin, and the faults of both."""
    obstacles, core = edges_of(ground.obstacles), edges_of(ground.core)
    ends = edges_of(ground.touched)
    best, beyond = math.inf, 0.0
    faults: list[AuditFault] = []
    for name, outlines in moving.items():
        in_core: list[Nearness] = []
        outside: list[Nearness] = []
        for outline in outlines:
            best = min(best, nearness_to_edges(outline, obstacles, inside=True, best=best).nearest)
            in_core.append(nearness_to_edges(outline, core, inside=True, best=0.0))
            outside.append(nearness_to_edges(outline, ends, inside=False, best=0.0))
        for kind, found, region, within in (
            ("in an obstacle", in_core, ground.obstacles, True),
            ("beyond the margin", outside, ground.allowed, False),
        ):
            least, share = _nearest(found)
            for first, last in spells(least <= 0.0, time):
                spell = _off(outlines, share, first, last, time, region, within)
                faults.append(AuditFault(kind, (name,), *spell, 0.0, "m^2"))
                beyond = max(beyond, 0.0 if within else faults[-1].amount)
    return best if math.isfinite(best) else None, beyond, faults


def _off(
    outlines: list[MovingOutline],
    share: np.ndarray,
    first: int,
    last: int,
    time: np.ndarray,
    region: BaseGeometry,
    within: bool,
) -> tuple[float, float, float, float]:
    """Begin, end and worst time of a spell off the ground [s], and the area off it then [m^2]."""
    numbers, shares = _looks(share, first, last)
    shapely.prepare(region)
    worst, at = -1.0, float(time[first])
    for outline in outlines:
        polygons = polygons_at(outline, numbers, shares)
        off = (shapely.intersection if within else shapely.difference)(polygons, region)
        areas = shapely.area(off)
        k = int(np.argmax(areas))
        if areas[k] > worst:
            worst, at = float(areas[k]), _moment(time, numbers[k], shares[k])
    return float(time[first]), float(time[last]), at, worst

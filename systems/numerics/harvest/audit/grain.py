"""Where the grain is: in tanks, in carts, delivered; it only comes from crop that is cut."""

import math

import numpy as np

from .crop import CropRecord
from .faults import AuditFault, faults_where
from .harvest_log import HarvestLog, Site

# What is exact to rounding [kg].
EXACT = 1e-6

# Between all grain and the area cut: a part of all, or the grain of so much area [m^2].
PART, AREA = 0.02, 100.0


def grain_faults(
    log: HarvestLog, site: Site, crop: CropRecord
) -> tuple[dict[str, float | None], list[AuditFault]]:
    """Weigh all the grain.

    Nothing may be below zero or above what a machine holds, what is delivered and all grain
    together never decrease, and all grain increases only while a header is down, as the area that
    is cut by what grows there: that which is stated, or else the mean of the log.

    Returns:
        Figures by name and faults.
    """
    time = log.time
    faults: list[AuditFault] = []

    def look(kind: str, machines: tuple[str, ...], beyond: np.ndarray, limit: float) -> None:
        faults.extend(
            faults_where(kind, machines, beyond, limit, "kg", time, lambda k: float(time[k + 1]))
        )

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

"""Where carts come beside combines next: a ring on the ground with the cart's number."""

import numpy as np
import shapely

from ...visuals.meshes import flat_mesh
from ...visuals.stage import Stage
from ...visuals.text import advance, text_mesh
from ..job import HarvestJob
from .palette import TRACTOR, combine_paint

# Radius of a ring and of its hole, letters and the height above crop, in view heights.
_OUTER, _INNER, _LETTER, _ABOVE = 0.0135, 0.0105, 0.013, 0.0062


class NextVisits:
    """Rings at `visits/V`, numbered in the order of the plan's visits, in the combine's colour.

    Of each cart only the ring of the visit that it is at, or makes next, is seen.

    Args:
        stage: Where to draw.
        span: Height of the view [m].
        job: Whose visits they are.
    """

    def __init__(self, stage: Stage, span: float, job: HarvestJob) -> None:
        self._stage, self._visits = stage, job.plan.service.visits
        letter = _LETTER * span
        stage.raise_to("visits", _ABOVE * span)
        for v, visit in enumerate(self._visits):
            pose = job.plan.service.plans[visit.combine].pose_at(visit.begin)
            x, y = pose[:2] + job.reach * np.array([-np.sin(pose[2]), np.cos(pose[2])])
            ring = (
                shapely.Point(0, 0)
                .buffer(_OUTER * span)
                .difference(shapely.Point(0, 0).buffer(_INNER * span))
            )
            stage.mesh(f"visits/{v}/ring", flat_mesh(ring), combine_paint(visit.combine))
            said = str(visit.cart)
            stage.mesh(f"visits/{v}/cart/said", text_mesh(said, letter, bold=True), TRACTOR)
            stage.place(f"visits/{v}/cart", -0.5 * advance(said) * letter, -0.35 * letter)
            stage.place(f"visits/{v}", float(x), float(y))

    def update(self, clocks: np.ndarray) -> None:
        """Show the next visit of each cart.

        Args:
            clocks: The time at which the plan has each cart where it is, shape (K,) [s].
        """
        seen = set()
        for v, visit in enumerate(self._visits):
            coming = visit.end > clocks[visit.cart] and visit.cart not in seen
            if coming:
                seen.add(visit.cart)
            self._stage.show(f"visits/{v}", bool(coming))

"""All layers of the tracking scene together, and what they draw at one time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ....systems.numerics.geometry.world import World
from ....systems.numerics.tracking.body_gaps import pair_gaps
from ...visuals.stage import Stage
from .floor_layers import (
    FieldLayer,
    LosingLayer,
    LosingSet,
    PursuitField,
    SightLines,
    Trails,
    VisibilityLayer,
)
from .layout import EVADER, PURSUER, Layout, set_camera
from .panel import Panel
from .robots import Team
from .static_scene import draw_world


@dataclass(frozen=True, kw_only=True)
class View:
    """The choices of a viewer of the tracking scene.

    Attributes:
        chosen_pursuer: Whose visibility polygon, losing set and field are drawn; -1 for nobody's.
        polygon_shown: Draw the visibility polygon.
        field_shown: Draw the pursuit field.
        losing_shown: Draw where the pursuer would lose an evader, where that is known.
    """

    chosen_pursuer: int = 0
    polygon_shown: bool = True
    field_shown: bool = True
    losing_shown: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """The game at one time.

    Attributes:
        time: Since the start of the run [s].
        pursuers: Positions, shape (Np, 2) [m].
        evaders: Positions, shape (Ne, 2) [m].
        pursuer_directions: Vectors along the headings, shape (Np, 2); zero where unknown.
        evader_directions: The same of the evaders, shape (Ne, 2).
        visibility: True where pursuer i sees evader j, shape (Np, Ne).
        assignment: The evader that each pursuer chases, or -1, shape (Np,).
        certificate: For how long all evaders can be kept [s]; None where that is not known.
    """

    time: float
    pursuers: np.ndarray
    evaders: np.ndarray
    pursuer_directions: np.ndarray
    evader_directions: np.ndarray
    visibility: np.ndarray
    assignment: np.ndarray
    certificate: float | None = None


class Layers:
    """The drawn scene: still parts at once, moving parts with every snapshot.

    Args:
        stage: Where to draw.
        layout: Sizes.
        world: Whose obstacles.
        grown: Where robots' centres may be.
        pursuers, evaders: How many.
        visibility_polygon: From a point, shape (2,) [m], to what it sees, shape (n, 2) [m].
        pursuit_field: Of a pursuer, at points.
        radii: Of all robots, pursuers first, shape (Np + Ne,) [m].
        losing_set: Of a pursuer at a place, where the solved visibility game is known.
        certificate: What the panel calls the certificate; None where there is none.
    """

    def __init__(
        self,
        stage: Stage,
        layout: Layout,
        world: World,
        grown: Sequence[World],
        *,
        pursuers: int,
        evaders: int,
        visibility_polygon: Callable[[np.ndarray], np.ndarray],
        pursuit_field: PursuitField,
        radii: np.ndarray,
        losing_set: LosingSet | None = None,
        certificate: str | None = None,
    ) -> None:
        self._stage = stage
        self._radii = radii
        set_camera(stage.meshcat, layout)
        draw_world(stage, layout, world, grown)
        self._pursuers = Team(stage, layout, "pursuers", pursuers)
        self._evaders = Team(stage, layout, "evaders", evaders)
        self._pursuer_trails = Trails(stage, layout, "pursuers", PURSUER)
        self._evader_trails = Trails(stage, layout, "evaders", EVADER)
        self._lines = SightLines(stage, layout)
        self._polygon = VisibilityLayer(stage, layout, visibility_polygon)
        self._losing = None if losing_set is None else LosingLayer(stage, layout, losing_set)
        self._field = FieldLayer(stage, layout, grown, pursuit_field)
        self._panel = Panel(
            stage, layout, pursuers=pursuers, evaders=evaders, certificate=certificate
        )

    def draw(self, now: Snapshot, view: View) -> None:
        """Draw the game as it is now, from the view that was chosen."""
        chosen = view.chosen_pursuer if 0 <= view.chosen_pursuer < len(now.pursuers) else None
        unseen = np.logical_not(np.any(now.visibility, axis=0, keepdims=True))[0]

        self._stage.begin(now.time)
        self._pursuers.move(now.pursuers, now.pursuer_directions)
        self._evaders.move(now.evaders, now.evader_directions)
        self._pursuers.mark_chosen(chosen)
        self._evaders.mark_unseen(unseen)
        self._pursuer_trails.update(now.time, now.pursuers)
        self._evader_trails.update(now.time, now.evaders)
        self._lines.update(now.pursuers, now.evaders, now.visibility, now.assignment)
        centres = np.concatenate([now.pursuers, now.evaders])
        gap = float(pair_gaps(centres, self._radii).min())
        self._panel.update(now.time, now.visibility, now.assignment, gap, now.certificate)

        looking = None if chosen is None or not view.polygon_shown else now.pursuers[chosen]
        self._polygon.update(now.time, looking)
        if self._losing is not None:
            losing = None if chosen is None or not view.losing_shown else now.pursuers[chosen]
            self._losing.update(now.time, losing)
        steering = chosen if view.field_shown else None
        self._field.update(now.time, steering, now.pursuers, now.evaders, now.assignment)

    def finish_recording(self) -> None:
        """End the recording with what was drawn last."""
        self._stage.finish_recording()

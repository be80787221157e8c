"""The harvest in Meshcat, as a system that draws what its input ports say.

The field turns from crop to stubble, tanks fill, carts carry; where carts come beside combines next
there is a ring on the ground with the cart's number.
"""

import math

import numpy as np
import shapely
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from ...systems.drake_parts import read
from ...systems.numerics.harvest.field.yield_map import mean_density
from ...systems.numerics.harvest.machines import COLUMNS, CUT, LOST
from ..tracking.scene.layout import make_layout, set_camera
from ..visuals.meshes import flat_mesh
from ..visuals.stage import Stage
from ..visuals.text import advance, text_mesh
from .colours import TRACTOR, combine_paint
from .crop_layer import CropLayer
from .job import HarvestJob
from .machine_shapes import CartShapes, CombineShapes, draw_trucks
from .panel import HarvestMoment, Panel

# Radius of a ring and of its hole, letters and the height above crop, in view heights.
_OUTER, _INNER, _LETTER, _ABOVE = 0.0135, 0.0105, 0.013, 0.0062

# Where everything is, in Meshcat's tree.
ROOT = "/harvest"
# Seconds of work in a second of a replay.
SPEED_UP = 60.0
# How far a replay may pass from where things were, relative to the view.
_TOLERANCE = 2e-4


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


class HarvestScene(LeafSystem):
    """Draws crop, combines with tanks, carts with loads and next visits, and a panel.

    .. pydrake_system::

        name: HarvestScene
        input_ports:
        - pose
        - station
        - tank
        - mode
        - account
        - state
        - load
        - delivered
        - alongside
        - emptying
        - late
        output_ports: []

    =========  =====  ================  =====
    port       size   unit              frame
    =========  =====  ================  =====
    pose       3 N    m, m, rad         world
    station    N      m                 path
    tank       N      kg                -
    mode       N      -                 -
    account    8 N    m, kg, s          -
    state      4 K    m, m, rad, rad    world
    load       K      kg                -
    delivered  K      kg                -
    alongside  N      -                 -
    emptying   K      -                 -
    late       N + K  s                 -
    =========  =====  ================  =====

    A recording plays `SPEED_UP` times as fast as the work goes on. A cart without a limit is shown
    full when it holds its share of the field's grain. The system has no state; it remembers only
    what Meshcat was told last.

    Source: Zhang 2014, Figure 3.8.
    """

    def __init__(
        self, job: HarvestJob, meshcat: Meshcat, *, publish_period: float, recording: bool
    ) -> None:
        """Draw what does not move; the rest follows at each publish event.

        Args:
            job: What is harvested, by whom.
            meshcat: Where to draw.
            publish_period: Time between pictures of the field [s].
            recording: Record what is drawn, for `write_replay`.
        """
        super().__init__()
        self._job, self.meshcat = job, meshcat
        self._period, self._recording = publish_period, recording
        n, k = job.scenario.combines.count, job.scenario.carts.count
        sizes = (
            ("pose", 3 * n),
            ("station", n),
            ("tank", n),
            ("mode", n),
            ("account", COLUMNS * n),
            ("state", 4 * k),
            ("load", k),
            ("delivered", k),
            ("alongside", n),
            ("emptying", k),
            ("late", n + k),
        )
        self._ports = {name: self.DeclareVectorInputPort(name, size) for name, size in sizes}
        self._grain = mean_density(job.crop, job.field.polygon) * job.field.area
        capacity = job.scenario.carts.capacity
        self._tank_sizes = np.array(
            [combine.capacity for combine in job.scenario.combines.machines()]
        )
        self._capacity = capacity if math.isfinite(capacity) else self._grain / k
        self._begins = _begins(job)
        self._begin()
        self.DeclareInitializationPublishEvent(lambda context: self._restart())
        self.DeclarePeriodicPublishEvent(publish_period, 0.0, self._publish)
        self.DeclareForcedPublishEvent(self._publish)

    def finish_recording(self) -> None:
        """End the recording with the last picture, so that a replay can be written.

        Raises:
            InvalidInput: The scene was made without `recording`.
        """
        self._stage.finish_recording()

    def _restart(self) -> EventStatus:
        if self._drawn:
            self._begin()
        return EventStatus.Succeeded()

    def _begin(self) -> None:
        """Draw what does not move, on a clean sheet."""
        self._drawn = False
        job, scenario = self._job, self._job.scenario
        layout = make_layout(job.field.ground.bounds, 0.0)
        self._stage = stage = Stage(
            self.meshcat,
            ROOT,
            recording=self._recording,
            period=self._period / SPEED_UP,
            tolerance=_TOLERANCE * layout.span,
        )
        set_camera(self.meshcat, layout)
        self._crop = CropLayer(stage, layout, job)
        draw_trucks(stage, scenario.carts, job.trucks)
        self._visits = NextVisits(stage, layout.span, job)
        self._combines = CombineShapes(
            stage, scenario.combines, job.reach, layout.span, scenario.combines.count
        )
        self._carts = CartShapes(stage, scenario.carts, layout.span, scenario.carts.count)
        counts = scenario.combines.count, scenario.carts.count
        self._panel = Panel(stage, layout, *counts, SPEED_UP if self._recording else None)

    def _publish(self, context: Context) -> EventStatus:
        def value(name: str) -> np.ndarray:
            return read(self._ports[name], context)

        time = context.get_time()
        self._stage.begin(time / SPEED_UP)
        account = value("account").reshape(-1, COLUMNS)
        tanks, loads = value("tank"), value("load")
        moment = HarvestMoment(
            time=time,
            share=float(account[:, CUT].sum()) / self._grain,
            tanks=tanks,
            tank_fills=tanks / self._tank_sizes,
            modes=value("mode"),
            loads=loads,
            load_fills=loads / self._capacity,
            doing=self._doing(time, value("alongside"), value("emptying"), value("late")),
            delivered=float(value("delivered").sum()),
            lost=float(account[:, LOST].sum()),
        )
        self._crop.update(value("station"))
        # As late as a cart is, so much later all that is planned for it begins.
        self._visits.update(time - value("late")[len(tanks) :])
        pouring = value("alongside") >= 0
        self._combines.move(value("pose").reshape(-1, 3), moment.tank_fills, pouring)
        self._carts.move(value("state").reshape(-1, 4), moment.load_fills)
        self._panel.update(moment)
        self._drawn = True
        self.meshcat.SetSimulationTime(time)
        return EventStatus.Succeeded()

    def _doing(
        self, time: float, alongside: np.ndarray, emptying: np.ndarray, late: np.ndarray
    ) -> list[int]:
        """Number of the panel's words for what each cart does, or is to do next."""
        count = len(alongside)
        found = []
        for k, empties in enumerate(emptying):
            pours = np.flatnonzero(alongside == k)
            # As late as it is, so much later all that is planned for it begins.
            clock = time - late[count + k]
            ahead = [begin for begin in self._begins[k] if begin[0] > clock]
            if len(pours):
                found.append(count + int(pours[0]))
            elif empties > 0.5:
                found.append(2 * count + 1)
            else:
                found.append(ahead[0][1] if ahead else 2 * count + 2)
        return found


def _begins(job: HarvestJob) -> list[list[tuple[float, int]]]:
    """When each cart is to begin a visit or a trip, and the number of the words for that."""
    count = job.scenario.combines.count
    found: list[list[tuple[float, int]]] = [[] for _ in range(job.scenario.carts.count)]
    for visit in job.plan.service.visits:
        found[visit.cart].append((visit.begin, visit.combine))
    for trip in job.plan.service.trips:
        found[trip.cart].append((trip.begin, 2 * count))
    return [sorted(each) for each in found]

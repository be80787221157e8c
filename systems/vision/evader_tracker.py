"""What the pursuers together know of the evaders from their pictures."""

from collections.abc import Sequence

import numpy as np
import shapely
from pydrake.common.containers import namedview
from pydrake.systems.framework import LeafSystem, ValueProducer

from ..drake_parts import AbstractValue, read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.world import World
from ..numerics.vision.estimation.shell_detection import Outcome
from ..numerics.vision.whereabouts.evader_tracks import (
    HYPOTHESIS_SIZE,
    TRACK_SIZE,
    Knowledge,
    Picture,
    Search,
    covariances_now,
    no_knowledge,
    positions_now,
    take_in,
)
from ..numerics.vision.whereabouts.reachable_set import make_place_grid, members

Frame = namedview("Frame", ["number", "time", "arrived"])
# Of each camera's inputs: name and size for each evader, or size alone.
_PER_EVADER = (("position", 2), ("covariance", 4), ("valid", 1), ("outcome", 1))
_PER_CAMERA = (("frame", 3), ("exposure_pose", 3))
# An evader that stands for ever has times of arrival too [m/s].
_CREEP = 1e-4


class EvaderTracker(LeafSystem):
    """Follows evaders in the pictures of all pursuers, and keeps the set where each may be.

    An evader that is seen has a Kalman filter of nearly constant velocity. One that is not may be
    wherever it can have gone since at its top speed v, round the walls, less where cameras have
    looked and seen nothing since: with V(t) what they see whole at t,

        S(t + h) = {x : d(x, S(t)) <= v h} without V(t + h), d along free ways.

    A detection outside the set begins a hypothesis, which is believed when it goes on for 0.2 s
    and the evader is not seen elsewhere meanwhile.

    .. pydrake_system::

        name: EvaderTracker
        input_ports:
        - position_0
        - covariance_0
        - valid_0
        - outcome_0
        - frame_0
        - exposure_pose_0
        - position_1
        - covariance_1
        - valid_1
        - outcome_1
        - frame_1
        - exposure_pose_1
        output_ports:
        - evader_position
        - evader_covariance
        - evader_velocity
        - evader_known
        - evader_set

    =================  =====  =========  =====  ===========
    port               size   unit       frame  feedthrough
    =================  =====  =========  =====  ===========
    position_0         2 Ne   m          world  -
    covariance_0       4 Ne   m^2        world  -
    valid_0            Ne     -          -      -
    outcome_0          Ne     -          -      -
    frame_0            3      -, s, -    -      -
    exposure_pose_0    3      m, m, rad  world  -
    position_1         2 Ne   m          world  -
    covariance_1       4 Ne   m^2        world  -
    valid_1            Ne     -          -      -
    outcome_1          Ne     -          -      -
    frame_1            3      -, s, -    -      -
    exposure_pose_1    3      m, m, rad  world  -
    evader_position    2 Ne   m          world  all
    evader_covariance  4 Ne   m^2        world  all
    evader_velocity    2 Ne   m/s        world  all
    evader_known       Ne     -          -      all
    evader_set         Ne Nc  -          world  all
    =================  =====  =========  =====  ===========

    There are inputs for each of the cameras, as of `ShellEstimator` and `OmniCameraSensor`; two
    are shown. Pictures are used once, for the time at which they were taken, however late they
    come. Covariances are row by row. `evader_position` is the present one, always where an evader
    can be, or outside the world while `evader_known` is 0: nothing sees it there.
    `evader_velocity` is the last that was seen; zero before. `evader_set` has Nc
    numbers for each evader, 1 for the cells where it may be, else 0; Nc, the number of cells of the
    attribute `grid` (a `PlaceGrid`), never changes.

    Source: ours; Zhang 2014, 2.2.8.3, collects the estimates at one work station.

    Args:
        world: Whose walls block sight.
        regions: Where the evaders' centres can be.
        cameras: Number of cameras.
        colours: Of each of the Ne evaders' shells; equal for identical ones.
        speed: Of the evaders, at most [m/s].
        period: Between looks at the inputs, not longer than the cameras' [s].
        delay: Of the first look, and so from a picture to its use [s].
        shell_radius: Of the evaders [m].
        body_radius: Of the pursuers, who stand in each other's sight [m].
        certain_range: Distances between which a camera finds every shell in its sight [m].
        turning_time: In which an evader may take up another velocity [s].
        cells: Number of cells of the sets, about.

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        world: World,
        regions: Sequence[World],
        *,
        cameras: int,
        colours: Sequence[str],
        speed: float,
        period: float,
        delay: float = 0.0,
        shell_radius: float = 0.1,
        body_radius: float = 0.1,
        certain_range: tuple[float, float] = (0.35, 2.5),
        turning_time: float = 0.15,
        cells: int = 10_000,
    ):
        super().__init__()
        require(cameras > 0, "cameras", "be positive", cameras)
        require(len(colours) > 0, "colours", "have an entry for each evader", list(colours))
        for name, value in (
            ("period", period),
            ("shell_radius", shell_radius),
            ("body_radius", body_radius),
            ("turning_time", turning_time),
        ):
            require_positive(name, value)
        require_non_negative("speed", speed)
        require_non_negative("delay", delay)
        near, far = certain_range
        require(0 < near < far, "certain_range", "be [least, greatest], positive", certain_range)
        self.grid = make_place_grid(regions, cells)
        kinds = sorted(set(colours))
        self._search = Search(
            grid=self.grid,
            walls=build_edge_index(world),
            colours=tuple(kinds.index(each) for each in colours),
            speed=max(float(speed), _CREEP),
            # A velocity that is another one after the turning time.
            density=max(float(speed), _CREEP) ** 2 / float(turning_time),
            shell_radius=float(shell_radius),
            certain_range=(float(near), float(far)),
            body_radius=float(body_radius),
        )
        self._free = shapely.union_all([region.polygon for region in regions])
        shapely.prepare(self._free)
        west, south, east, _ = self._free.bounds
        self._nowhere = np.array([west - (east - west), south - (east - west)])
        evaders = len(colours)
        self._delay = float(delay)
        self._cameras = [
            {
                name: self.DeclareVectorInputPort(f"{name}_{i}", size)
                for name, size in (
                    *((name, size * evaders) for name, size in _PER_EVADER),
                    *_PER_CAMERA,
                )
            }
            for i in range(cameras)
        ]
        nothing = no_knowledge(self._search)
        self._numbers = self.DeclareDiscreteState(state_vector(np.full(cameras, -1.0)))
        self._tracks = self.DeclareDiscreteState(state_vector(nothing.tracks.ravel()))
        self._hypotheses = self.DeclareDiscreteState(state_vector(nothing.hypotheses.ravel()))
        self._sets = self.DeclareDiscreteState(state_vector(nothing.sets.ravel()))
        self.DeclarePeriodicDiscreteUpdateEvent(period, delay, self._update)
        present = {self.xd_ticket(), self.time_ticket(), self.all_input_ports_ticket()}
        self._present = self.DeclareCacheEntry(
            "present",
            ValueProducer(allocate=lambda: AbstractValue.Make(()), calc=self._calc),
            present,
        )
        for name, size, calc in (
            ("evader_position", 2, self._calc_position),
            ("evader_covariance", 4, self._calc_covariance),
            ("evader_velocity", 2, self._calc_velocity),
            ("evader_known", 1, self._calc_known),
            ("evader_set", len(self.grid.usable), self._calc_set),
        ):
            self.DeclareVectorOutputPort(name, size * evaders, calc, prerequisites_of_calc=present)

    def _knowledge(self, values) -> Knowledge:
        """What is remembered, as views of a state's arrays.

        Args:
            values: A function from the index of a group of the state to its array.
        """
        return Knowledge(
            values(self._tracks).reshape(-1, TRACK_SIZE),
            values(self._hypotheses).reshape(-1, HYPOTHESIS_SIZE),
            values(self._sets).reshape(len(self._search.colours), 4, -1),
        )

    def _pictures(self, context, due: bool) -> tuple[list[Picture], np.ndarray]:
        """Pictures that were not taken in, and the numbers of all that there are, shape (cameras,).

        Args:
            context: Of this system.
            due: Only those whose delay is over.
        """
        numbers = context.get_discrete_state(self._numbers).value().copy()
        pictures = []
        for i, ports in enumerate(self._cameras):
            frame = Frame(read(ports["frame"], context))
            early = due and context.get_time() < frame.time + self._delay - 1e-9
            if frame.number < 0 or frame.number == numbers[i] or early:
                continue
            numbers[i] = frame.number
            values = {name: read(port, context) for name, port in ports.items()}
            valid = values["valid"] > 0.5
            blob = ~np.isin(values["outcome"], [Outcome.NO_BLOB, Outcome.NOT_ANOTHER])
            pictures.append(
                Picture(
                    time=float(frame.time),
                    pose=values["exposure_pose"],
                    positions=values["position"].reshape(-1, 2),
                    covariances=values["covariance"].reshape(-1, 2, 2),
                    valid=valid,
                    doubtful=blob & ~valid,
                )
            )
        return pictures, numbers

    def _update(self, context, discrete_state):
        pictures, numbers = self._pictures(context, due=False)
        discrete_state.set_value(self._numbers, numbers)
        knowledge = self._knowledge(discrete_state.get_mutable_value)
        take_in(self._search, knowledge, pictures, context.get_time())

    def _calc(self, context, value):
        """What is known now: pictures count from the moment at which they are due."""
        state, now = context.get_discrete_state(), context.get_time()
        knowledge = self._knowledge(lambda group: state.value(group))
        pictures, _ = self._pictures(context, due=True)
        if pictures:
            knowledge = Knowledge(
                knowledge.tracks.copy(), knowledge.hypotheses.copy(), knowledge.sets.copy()
            )
            take_in(self._search, knowledge, pictures, now)
        places = positions_now(self._search, knowledge, now)
        spreads = covariances_now(self._search, knowledge, places, now)
        for j, place in enumerate(places):
            if np.isnan(place[0]):
                places[j] = self._nowhere
            elif not self._free.contains(point := shapely.Point(place)):
                places[j] = shapely.shortest_line(self._free, point).coords[0]
        value.set_value((knowledge, places, spreads))

    def _calc_position(self, context, output):
        output.set_value(self._known_now(context)[1].ravel())

    def _calc_covariance(self, context, output):
        output.set_value(self._known_now(context)[2].ravel())

    def _calc_velocity(self, context, output):
        output.set_value(self._known_now(context)[0].tracks[:, 6:8].ravel())

    def _calc_known(self, context, output):
        seen = np.isfinite(self._known_now(context)[0].tracks[:, 0])
        output.set_value(seen.astype(float))

    def _calc_set(self, context, output):
        sets, now = self._known_now(context)[0].sets, context.get_time()
        output.set_value(np.concatenate([members(each, now) for each in sets]).astype(float))

    def _known_now(self, context) -> tuple[Knowledge, np.ndarray, np.ndarray]:
        return self._present.Eval(context)  # type: ignore[return-value]  # the stubs say object

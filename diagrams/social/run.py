"""Running a search from start to horizon."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput

from ...systems.numerics.errors import require_type
from ...systems.numerics.social.localisation.location import Reading
from ...systems.numerics.social.network.interface import SocialNetwork
from ...systems.social.forward_cameras import ForwardCameras
from .make_social_search import VECTORS, MakeSocialSearch
from .social_game import SocialGame
from .social_scene import SocialScene


@dataclass(frozen=True, eq=False)
class SocialRun:
    """What happened in a search.

    Attributes:
        game: What was searched.
        times: Samples, shape (T,) [s].
        log: Samples of each port in VECTORS by name: pose (T, 2 + agents, 3), connected and
            waiting (T, agents) bool, evader_position (T, 2) and evader_covariance (T, 2, 2), route
            (T, K, 2), the others (T,).
        readings: What came of all pictures that were read, in that order.
        wall_time: How long it took [s].
        scene: Where it was drawn, or None.
    """

    game: SocialGame
    times: np.ndarray
    log: dict[str, np.ndarray]
    readings: tuple[Reading, ...]
    wall_time: float
    scene: SocialScene | None

    @property
    def located(self) -> np.ndarray:
        """Samples at which the evader was located anew, shape (L,)."""
        at = self.log["located_at"]
        return np.flatnonzero((np.diff(at, prepend=-1.0) != 0) & (at >= 0))

    @property
    def location_errors(self) -> np.ndarray:
        """Distance of each location from where the evader was in that picture, shape (L,) [m]."""
        k = self.located
        taken = np.searchsorted(self.times, self.log["located_at"][k] - 1e-6)
        truth = self.log["pose"][taken, 1, :2]
        return np.hypot(*(self.log["evader_position"][k] - truth).T)


def run_social_search(
    game: SocialGame,
    network: SocialNetwork,
    meshcat: Meshcat | None = None,
    *,
    recording: bool = False,
    realtime_rate: float = 0.0,
    progress: Callable[[float], None] = lambda seconds: None,
) -> SocialRun:
    """Search.

    Args:
        game: What is searched.
        network: Where agents post.
        meshcat: Where to draw it.
        recording: Record what is drawn for a replay.
        realtime_rate: Simulated seconds per second, 0 for as fast as possible.
        progress: Told the simulated time now and then [s].

    Raises:
        InvalidInput: `game` is no SocialGame.
    """
    require_type("game", game, SocialGame)
    period = game.scenario.period
    builder = DiagramBuilder()
    search = MakeSocialSearch(game, meshcat, network=network, recording=recording)
    builder.AddSystem(search)
    sinks = {name: LogVectorOutput(search.GetOutputPort(name), builder, period) for name in VECTORS}
    diagram = builder.Build()
    diagram.set_name("social_search_run")
    simulator = Simulator(diagram)
    simulator.set_target_realtime_rate(realtime_rate)
    context = simulator.get_context()
    inside = search.GetMyContextFromRoot(context)
    readings_port = search.GetOutputPort("readings")
    began = time.perf_counter()
    simulator.Initialize()
    readings: list[Reading] = []
    last: tuple[Reading, ...] = ()
    steps = int(np.ceil(game.scenario.seconds / period - 1e-9))
    for step in range(1, steps + 1):
        simulator.AdvanceTo(step * period)
        if step == steps:
            # The sample at the horizon itself is otherwise taken in the step that would follow.
            simulator.AdvancePendingEvents()
        found: tuple[Reading, ...] = readings_port.Eval(inside)  # type: ignore[assignment]  # the stubs say object
        if found is not last:
            readings += found
            last = found
        progress(step * period)
    cameras = search.GetSubsystemByName("cameras")
    assert isinstance(cameras, ForwardCameras)
    cameras.release()
    scene = search.GetSubsystemByName("scene") if meshcat is not None else None
    logs = {name: sinks[name].FindLog(context) for name in VECTORS}
    times = np.asarray(logs["pose"].sample_times())
    return SocialRun(
        game=game,
        times=times,
        log=_shaped({name: np.array(each.data()).T for name, each in logs.items()}),
        readings=tuple(readings),
        wall_time=time.perf_counter() - began,
        scene=scene if isinstance(scene, SocialScene) else None,
    )


def _shaped(log: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Samples in the shapes and types that `SocialRun` promises."""
    count = len(log["pose"])
    shapes = {"pose": (-1, 3), "evader_covariance": (2, 2), "route": (-1, 2)}
    shaped = {name: each.reshape(count, *shapes.get(name, (-1,))) for name, each in log.items()}
    for name in ("requests_sent", "pictures_scanned", "locations", "located_at"):
        shaped[name] = shaped[name][:, 0]
    for name in ("connected", "waiting"):
        shaped[name] = shaped[name] > 0.5
    return shaped

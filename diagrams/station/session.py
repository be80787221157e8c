"""Everything about a run that is not the run: devices, robots that wait for the word, the view."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.station.freshness import freshness
from ..tracking.game import TrackingGame
from .hardware import Devices, Operator, Scene, StopPage, ViewerLink, open_devices, open_view
from .scenario import StationScenario

# How long the motion capture may take until it has seen every robot [s].
_PATIENCE = 2.0


@contextmanager
def open_laboratory(
    scenario: StationScenario, game: TrackingGame, mode: str, operator: Operator
) -> Iterator[bool | Devices]:
    """What `MakeStation` takes as `hardware`: the devices, with robots armed, or False.

    An emergency stop goes to the robots at once, from whatever thread it comes. On leaving, and
    after an error, all of them are stopped.

    Args:
        scenario: The laboratory.
        game: What is played.
        mode: simulate, emulate or hardware.
        operator: Who may pause and stop.

    Raises:
        InvalidInput: Robots are silent, or are not seen.
        SightfieldError: A device is missing, a robot does not answer, or is not seen.
    """
    if mode == "simulate":
        yield False
        return
    with open_devices(scenario, game, emulate=mode == "emulate") as devices:
        _wait_for_poses(scenario, devices)
        answered = devices.radio.arm()
        silent = [each for each in scenario.robots if each not in answered]
        if silent:
            names = ", ".join(map(str, silent))
            raise InvalidInput(f"`radio.robots` must all answer on the radio; silent: {names}")
        operator.on_stop(devices.radio.stop)
        yield devices


def _wait_for_poses(scenario: StationScenario, devices: Devices) -> None:
    """Until every robot is seen."""
    deadline = time.monotonic() + _PATIENCE
    while True:
        now = time.monotonic()
        valid, _ = freshness(now, devices.poses.read().stamps, scenario.mocap.stale_after)
        if valid.all():
            return
        if now > deadline:
            unseen = [n for n, good in zip(scenario.bodies, valid, strict=True) if not good]
            raise InvalidInput(
                f"`mocap.bodies` must all be seen by the motion capture; not seen: "
                f"{', '.join(unseen)}"
            )
        time.sleep(0.02)


@contextmanager
def show_on_view(
    scenario: StationScenario,
    game: TrackingGame,
    *,
    title: str,
    mode: str,
    operator: Operator,
    port: int,
) -> Iterator[tuple[ViewerLink, str]]:
    """The link to the operator's view, which is opened if there is none, and its address.

    The address holds the run's key. The controller serves a page of its own beside it, with a stop
    that works while the view does not: its address is that of the link's scene.

    Args:
        scenario: The laboratory.
        game: What is played.
        title: Stands above the view.
        mode: How it is played.
        operator: Who may pause and stop.
        port: Of the view.

    Raises:
        SightfieldError: The view cannot be opened.
    """
    view = open_view(port)
    pursuers = scenario.tracking.pursuers
    regions = [*game.pursuer_regions]
    scene = Scene(
        title=title,
        mode=mode,
        boundary=game.world.boundary.tolist(),
        obstacles=[ring.tolist() for ring in game.world.obstacles],
        limits=[ring.tolist() for region in regions for ring in region.rings],
        pursuers=[f"pursuer {i}" for i in range(pursuers.size)],
        evaders=[f"evader {j}" for j in range(scenario.tracking.evaders.size)],
        # A body that is a little smaller than the distance its centre keeps.
        radius=0.75 * pursuers.radius or 0.05,
    )
    with (
        StopPage(operator, title, port) as stop,
        ViewerLink(view.states, view.words, replace(scene, stop_page=stop.url), operator) as link,
    ):
        yield link, f"{view.url}#{link.key}"

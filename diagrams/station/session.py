"""Everything about a run that is not the run: devices, robots at their starts, the view.

Robots drive to where the game begins one after the other. While one drives the others stand, and
it goes round them by a shortest way. One whose place is taken, or that is shut in, waits; if all
do, as two that stand in one another's places, one goes aside first.
"""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from ...systems.numerics.errors import InvalidInput, SightfieldError
from ...systems.numerics.social.routes.motion import (
    FollowingLaw,
    drive_towards,
    progress_along,
)
from ...systems.numerics.social.routes.shortest_route import (
    Route,
    build_route_graph,
    rounded_regions,
    shortest_route,
)
from ...systems.numerics.station.channel import freshness
from ..tracking.game import TrackingGame
from .hardware import Devices, Operator, Scene, StopPage, ViewerLink, open_devices, open_view
from .scenario import StationScenario

# How long the motion capture may take until it has seen every robot [s].
_UNSEEN = 2.0


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
    deadline = time.monotonic() + _UNSEEN
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


# Between two commands [s].
_PERIOD = 0.05
# A robot has arrived that is so near to its place [m], and turned that far to its heading [rad].
_THERE, _TURNED = 0.03, 0.08
# Part of the fastest robot's top speed, and the way before the end on which it slows down [m].
_PART, _SLOWING = 0.8, 0.15
# Of robots that have no radius [m], and what is left between two beside that [m].
_RADIUS, _GAP = 0.1, 0.04
# A robot has to get on by so much [m], [rad] in this time, and to be seen after it [s].
_ON, _PATIENCE = 0.01, 2.0
# Robots stand so long before the next drives [s].
_REST = 0.3


@dataclass(frozen=True)
class DrivenToStart:
    """A robot that has driven.

    Attributes:
        name: Of the robot.
        way: It has driven [m].
        aside: Whether it made way only, and is to drive again.
    """

    name: str
    way: float
    aside: bool


def drive_to_start(
    scenario: StationScenario, game: TrackingGame, devices: Devices
) -> Iterator[DrivenToStart]:
    """Let robots, which are armed, drive to their starts, one after the other.

    Args:
        scenario: The laboratory.
        game: What is played, set up.
        devices: Of the laboratory, open.

    Raises:
        SightfieldError: A device fails, a robot is not seen or does not get on, or there is no way.
    """
    floor = _Floor(scenario, game, devices)
    asides = 0
    while True:
        poses = floor.poses()
        waiting = [k for k in range(scenario.size) if not floor.is_there(k, poses)]
        if not waiting:
            return
        routes = {k: floor.route(k, poses, floor.starts[k, :2]) for k in waiting}
        ready = [k for k in waiting if routes[k].found]
        aside = not ready
        if aside:
            asides += 1
            robot, route = floor.way_aside(waiting, poses)
            if route is None or asides > scenario.size:
                names = ", ".join(scenario.names[k] for k in waiting)
                raise SightfieldError(f"there is no way to the start for {names}: carry them")
        else:
            robot = ready[0]
            route = routes[robot]
        way = floor.drive(robot, route, None if aside else float(floor.starts[robot, 2]))
        yield DrivenToStart(scenario.names[robot], way, aside)


class _Floor:
    """The floor with all robots on it, and the one that drives."""

    def __init__(self, scenario: StationScenario, game: TrackingGame, devices: Devices) -> None:
        self.starts = np.concatenate([game.pursuer_starts, game.evader_starts])
        self._scenario, self._devices = scenario, devices
        radius = max(max(scenario.radii), _RADIUS)
        self._graph = build_route_graph(rounded_regions(game.world, 0.95 * radius))
        self._apart = 2 * radius + _GAP
        teams = (scenario.tracking.pursuers, scenario.tracking.evaders)
        self._law = FollowingLaw(
            speed=_PART * max(team.top_speed for team in teams),
            turn_rate=min(FollowingLaw.turn_rate, max(team.top_turn_rate for team in teams)),
            stand_off=0.0,
        )

    def poses(self) -> np.ndarray:
        """Of all robots, shape (N, 3); waits until all are seen."""
        end = time.monotonic() + _PATIENCE
        while True:
            reading, now = self._devices.poses.read(), time.monotonic()
            valid, _ = freshness(now, reading.stamps, self._scenario.mocap.stale_after)
            if valid.all():
                return reading.poses
            self._send(0, np.zeros(2))
            if now > end:
                unseen = [self._scenario.names[k] for k in np.flatnonzero(valid < 0.5)]
                raise SightfieldError(f"robots must be seen to drive; not seen: {unseen}")
            time.sleep(_PERIOD)

    def is_there(self, k: int, poses: np.ndarray) -> bool:
        """Whether robot k is at its start."""
        gone = math.hypot(*(poses[k, :2] - self.starts[k, :2]).tolist())
        turn = math.remainder(float(poses[k, 2] - self.starts[k, 2]), math.tau)
        return gone <= 1.5 * _THERE and abs(turn) <= 1.5 * _TURNED

    def route(self, k: int, poses: np.ndarray, goal: np.ndarray) -> Route:
        """Of robot k round the others; not found where one of them stands on the goal."""
        others = np.delete(poses[:, :2], k, axis=0)
        route = shortest_route(self._graph, poses[k, :2], goal, avoid=others, distance=self._apart)
        taken = (np.hypot(*(others - goal).T) < self._apart - _GAP).any()
        return Route(route.points, math.inf, False) if taken else route

    def way_aside(self, waiting: list[int], poses: np.ndarray) -> tuple[int, Route | None]:
        """The shortest way for one of those that wait to a corner that is in nobody's way."""
        found: list[tuple[float, int, Route]] = []
        for k in waiting:
            others = np.concatenate([np.delete(poses[:, :2], k, axis=0), self.starts[:, :2]])
            for corner in self._graph.nodes:
                if np.hypot(*(others - corner).T).min() > self._apart:
                    route = self.route(k, poses, corner)
                    found += [(route.length, k, route)] if route.found else []
        if not found:
            return waiting[0], None
        _, robot, route = min(found, key=lambda each: each[:2])
        return robot, route

    def drive(self, k: int, route: Route, heading: float | None) -> float:
        """Drive robot k along a way, and turn it; returns how far it went [m]."""
        way, arc = 0.0, 0.0
        before = anchor = self.poses()[k]
        due = time.monotonic() + _PATIENCE
        while True:
            pose = self.poses()[k]
            way += math.hypot(*(pose - before)[:2].tolist())
            before = pose
            left = math.hypot(*(route.points[-1] - pose[:2]).tolist())
            turn = 0.0 if heading is None else math.remainder(heading - float(pose[2]), math.tau)
            arc, command = self._command(route, pose, arc, left, turn)
            if not command.any():
                break
            if np.abs(pose - anchor).max() > _ON:
                anchor, due = pose, time.monotonic() + _PATIENCE
            if time.monotonic() > due:
                name = self._scenario.names[k]
                raise SightfieldError(f"{name} does not get on: it was told to drive, and stands")
            self._send(k, command)
            time.sleep(_PERIOD)
        for _ in range(round(_REST / _PERIOD)):
            self._send(k, np.zeros(2))
            time.sleep(_PERIOD)
        return way

    def _command(
        self, route: Route, pose: np.ndarray, arc: float, left: float, turn: float
    ) -> tuple[float, np.ndarray]:
        """Where the robot is along the way, and its speed and turn rate; zeros at the end."""
        law = self._law
        if left <= _THERE:
            if abs(turn) <= _TURNED:
                return arc, np.zeros(2)
            rate = min(law.gain * abs(turn), law.turn_rate)
            return arc, np.array([0.0, math.copysign(max(rate, 0.4), turn)])
        along = progress_along(self._graph.index, route.points, pose[:2], arc, law.lookahead)
        east, north = (along.aim - pose[:2]).tolist()
        command = drive_towards(law, float(pose[2]), math.atan2(north, east))
        command[0] *= min(1.0, max(left / _SLOWING, 0.25))
        return along.arc, command

    def _send(self, k: int, command: np.ndarray) -> None:
        commands = np.zeros((self._scenario.size, 2))
        commands[k] = command
        self._devices.radio.send_commands(commands)

"""Tells the operator's view how things stand."""

from collections import deque
from typing import Protocol

import numpy as np
from pydrake.systems.framework import LeafSystem

from ...systems.drake_types import read
from ...systems.numerics.errors import require, require_non_negative, require_positive
from ...systems.numerics.station.transitions import reason_words, standing_name, transitions
from .messages import Event, RobotState, State, or_none

# How many events are told.
_EVENTS = 50


class Shows(Protocol):
    """Something that takes a state."""

    def show(self, state: State) -> None:
        """Show it."""
        ...


class StatePublisher(LeafSystem):
    """Sends the state of the robots to the operator's view, a few times a second.

    .. pydrake_system::

        name: StatePublisher
        input_ports:
        - pursuer_poses
        - evader_poses
        - pursuer_valid
        - evader_valid
        - pursuer_age
        - evader_age
        - visibility
        - assignment
        - quality
        - battery
        - mode
        - sent_command
        - standing
        - reason
        output_ports: []

    =============  =====  ==========  =====
    port           size   unit        frame
    =============  =====  ==========  =====
    pursuer_poses  3 Np   m, m, rad   world
    evader_poses   3 Ne   m, m, rad   world
    pursuer_valid  Np     -           -
    evader_valid   Ne     -           -
    pursuer_age    Np     s           -
    evader_age     Ne     s           -
    visibility     Np Ne  -           -
    assignment     Np     -           -
    quality        N      -           -
    battery        N      V           -
    mode           1      -           -
    sent_command   2 N    m/s, rad/s  robot
    standing       N      -           -
    reason         N      -           -
    =============  =====  ==========  =====

    `standing` and `reason` are numbers of Standing and Reason; each change of them is an event.

    Source: the user interface of Zhang 2014, 2.2.8, Figure 2.24.

    Args:
        view: Where to.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        period: Between states [s].
        offset: After which it begins [s].
        looks: How often in a period it looks for events.

    Raises:
        InvalidInput: The period is not positive, or the offset negative.
    """

    def __init__(
        self,
        view: Shows,
        *,
        pursuers: int,
        evaders: int,
        period: float = 0.1,
        offset: float = 0.0,
        looks: int = 1,
    ):
        super().__init__()
        require_positive("period", period)
        require_non_negative("offset", offset)
        require(looks > 0, "looks", "be positive", looks)
        self._view, self._shape = view, (pursuers, evaders)
        self._names = [f"pursuer {i}" for i in range(pursuers)]
        self._names += [f"evader {j}" for j in range(evaders)]
        # What was shown: the log is the state.
        self._known: tuple[np.ndarray, np.ndarray] | None = None
        self._events: deque[Event] = deque(maxlen=_EVENTS)
        count = pursuers + evaders
        sizes = {
            "pursuer_poses": 3 * pursuers,
            "evader_poses": 3 * evaders,
            "pursuer_valid": pursuers,
            "evader_valid": evaders,
            "pursuer_age": pursuers,
            "evader_age": evaders,
            "visibility": pursuers * evaders,
            "assignment": pursuers,
            "quality": count,
            "battery": count,
            "mode": 1,
            "sent_command": 2 * count,
            "standing": count,
            "reason": count,
        }
        self._ports = {
            name: self.DeclareVectorInputPort(name, size) for name, size in sizes.items()
        }
        # First the events, where both are due.
        self.DeclarePeriodicPublishEvent(period / looks, offset, self._look)
        self.DeclarePeriodicPublishEvent(period, offset, self._publish)

    def _look(self, context):
        now = (read(self._ports["standing"], context), read(self._ports["reason"], context))
        for each in transitions(self._names, self._known, now):
            event = Event(time=context.get_time(), robot=each.robot, text=each.text)
            self._events.append(event)
        self._known = now

    def _publish(self, context):
        values = {name: read(port, context) for name, port in self._ports.items()}

        def both(name: str) -> np.ndarray:
            return np.concatenate([values[f"pursuer_{name}"], values[f"evader_{name}"]])

        self._view.show(
            State(
                time=context.get_time(),
                operator=float(values["mode"][0]),
                poses=both("poses").reshape(-1, 3).tolist(),
                valid=(both("valid") > 0.5).tolist(),
                age=[or_none(age) for age in both("age")],
                sight=(values["visibility"] > 0.5).reshape(self._shape).tolist(),
                assignment=np.rint(values["assignment"]).astype(int).tolist(),
                quality=[or_none(each) for each in values["quality"]],
                battery=[or_none(each) for each in values["battery"]],
                commands=values["sent_command"].reshape(-1, 2).tolist(),
                robots=[
                    RobotState(name=name, state=standing_name(standing), why=reason_words(reason))
                    for name, standing, reason in zip(
                        self._names, values["standing"], values["reason"], strict=True
                    )
                ],
                events=list(self._events),
            )
        )

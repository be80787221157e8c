"""Definition of a kind of robots: its link, its silence limit, and its stand-in robots."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from ...systems.numerics.errors import require, require_extra, require_positive
from ...systems.numerics.geometry.world import World
from ...systems.numerics.station.motion_checks import Chassis
from ..emulation.air import Air, AirSettings
from ..emulation.laboratory import LaboratorySnapshot
from ..emulation.stand_in_laboratory import Board, StandInLaboratory, Wire
from ..links.robot_link import RobotLink

# A message that comes after its deadline.
LATE = "late"
# A message that has come before.
REPEATED = "repeated"
# A message that was overtaken by one sent later.
REORDERED = "reordered"


@dataclass(frozen=True, kw_only=True)
class RobotFleet:
    """Robots of one kind, and how they are reached.

    Attributes:
        robots: Their numbers.
        port: Serial port, for kinds that have one.
        baud_rate: Baud rate of the port [baud].
        addresses: Network address of each robot, in the order of the numbers, for kinds that have
            them.
        options: The kind's own settings, by name.
        chassis: Wheels of the robots. Kinds whose robots report odometry instead of encoder counts
            compute the counts with it.
    """

    robots: tuple[int, ...]
    port: str = ""
    baud_rate: int = 57600
    addresses: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)
    chassis: Chassis = field(default_factory=Chassis)

    def option(self, name: str, default: Any) -> Any:
        """Return one of the kind's own settings.

        Args:
            name: Name of the setting.
            default: Value if it is not set; a set value must be of the same type.

        Raises:
            InvalidInput: The value is of another type.
        """
        value = self.options.get(name, default)
        if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        wanted = type(default)
        good = type(value) is wanted
        require(good, f"radio.options.{name}", f"be of type {wanted.__name__}", value)
        return value


class _Asked(Mapping[str, Any]):
    """Options that remember by which names they were asked for."""

    def __init__(self, options: Mapping[str, Any]) -> None:
        self._options = options
        self.names: set[str] = set()

    def __getitem__(self, name: str) -> Any:
        self.names.add(name)
        return self._options[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._options)

    def __len__(self) -> int:
        return len(self._options)


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """Surroundings of robots that stand in.

    Attributes:
        starts: Start poses, shape (n, 3) [m], [m], [rad].
        air: Radio channel between station and robots.
        seed: Seed of the random losses and delays.
        world: Walls that infrared sensors feel, or None.
        silence: Silence after which the robots stop by themselves [s].
    """

    starts: np.ndarray
    air: AirSettings = field(default_factory=AirSettings)
    seed: int = 0
    world: World | None = None
    silence: float

    def laboratory(
        self, robots: Sequence[int], make_board: Callable[[int], Board], wire: Wire
    ) -> StandInLaboratory:
        """Return a laboratory of stand-in robots, a context manager.

        Args:
            robots: Their numbers.
            make_board: Makes the program of a robot, given its number from 0.
            wire: The kind's way of carrying messages.

        Raises:
            InvalidInput: An argument is out of its range.
        """
        return StandInLaboratory(
            robots,
            self.starts,
            make_board,
            wire,
            air=self.air,
            seed=self.seed,
            world=self.world,
        )


class Laboratory(Protocol):
    """Robots that stand in, their true poses, and what can go wrong with them."""

    @property
    def air(self) -> Air:
        """Radio channel between station and robots."""
        ...

    def time(self) -> float:
        """Time since the laboratory was entered [s]."""
        ...

    def snapshot(self) -> LaboratorySnapshot:
        """The true state now."""
        ...

    def poses(self) -> np.ndarray:
        """True poses, shape (n, 3) [m], [m], [rad]."""
        ...

    def wheel_speeds(self) -> np.ndarray:
        """Left and right, shape (n, 2) [m/s]."""
        ...

    def place(self, k: int, pose: np.ndarray) -> None:
        """Carry robot k to a pose, shape (3,) [m], [m], [rad]."""
        ...

    def set_encoder(self, k: int, wheel: int, sense: int) -> None:
        """Set in which direction an encoder counts.

        Args:
            k: Number of the robot.
            wheel: 0 for the left, 1 for the right.
            sense: 1 the wheel's way, -1 the other way, 0 nothing.
        """
        ...

    def reset_robot(self, k: int) -> None:
        """Restart the program of robot k."""
        ...

    def cut_radio(self) -> float:
        """Let no messages through any more; returns the time of the cut [s]."""
        ...

    def restore_radio(self) -> None:
        """Let messages through again."""
        ...


Opened = AbstractContextManager[tuple[Laboratory, RobotFleet]]


@dataclass(frozen=True, kw_only=True)
class RobotKind:
    """A kind of robots.

    Attributes:
        name: As in a scenario's `radio.kind`.
        silence: Silence after which its robots stop by themselves [s]. It must be given: nothing
            else stops a robot whose work station is gone.
        link: Makes the link to a fleet, not yet connected.
        stand_in: Opens robots that stand in for a fleet's, and says how those are reached.
        recognises: Which bad messages its robots detect and ignore, a subset of "late", "repeated"
            and "reordered". They follow the others, until silence.
        extra: Extra of this package that installs what the kind needs; empty: none.
        needs: Names of the modules that the kind imports.

    Raises:
        InvalidInput: `silence` is missing or not positive, or `recognises` has an unknown name.
    """

    name: str
    silence: float | None = None
    link: Callable[[RobotFleet], RobotLink]
    stand_in: Callable[[RobotFleet, Surroundings], Opened]
    recognises: frozenset[str] = frozenset({LATE, REPEATED, REORDERED})
    extra: str = ""
    needs: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        wish = f"say after what time [s] robots of kind {self.name} stop by themselves"
        require(self.silence is not None, "silence", wish, self.silence)
        require_positive("silence", self.silence or 0.0)
        known = {LATE, REPEATED, REORDERED}
        require(self.recognises <= known, "recognises", f"be of {sorted(known)}", self.recognises)

    @property
    def stops_after(self) -> float:
        """Silence after which robots stop by themselves [s]; never None."""
        assert self.silence is not None
        return self.silence

    def open_link(self, fleet: RobotFleet) -> RobotLink:
        """Make the link to a fleet, not yet connected.

        Raises:
            InvalidInput: The kind's extra is not installed, the fleet lacks what the kind needs, or
                has an option that the kind does not read when it makes the link.
        """
        self.require_installed()
        asked = _Asked(fleet.options)
        link = self.link(replace(fleet, options=asked))
        # Misspelt options must not pass: without `key_file`, say, nothing would be signed.
        for name, value in fleet.options.items():
            known = f"be one that kind {self.name} has ({', '.join(sorted(asked.names)) or 'none'})"
            require(name in asked.names, f"radio.options.{name}", known, value)
        return link

    def open_stand_in(self, fleet: RobotFleet, around: Surroundings) -> Opened:
        """Robots that stand in for a fleet's.

        Raises:
            InvalidInput: The kind's extra is not installed.
        """
        self.require_installed()
        return self.stand_in(fleet, around)

    def require_installed(self) -> None:
        """Check that the packages needed for links and stand-in robots are installed.

        Raises:
            InvalidInput: The kind's extra is not installed.
        """
        require_extra(f"`radio.kind` {self.name}", self.extra, self.needs)

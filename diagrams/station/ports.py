"""The ports of a station, the same in every mode."""

from .scenario import StationScenario

COMMANDS = "team.velocity_commands"
SENT = "team.sent_commands"
IMAGE = "omni_camera.image"
MODE = "operator.mode"
STARTS_SAID = "operator.starts_said"
VIEW_AGE = "operator.view_age"
STANDING, REASON, CLOCK = "supervisor.standing", "supervisor.reason", "supervisor.clock"

# Sensors of a robot.
INFRARED = 4


def device_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of every port that a device fills, by name, in the order in which data flows.

    Poses are x, y [m], heading [rad]; `.valid` is 1 or 0; `.age` is the age at the last tick and
    `.stamp` the time at which it was taken [s]; ranges [m], battery [V], quality from 0 to 1; state
    and flags as robots report them, and counts of the left and right encoder.
    """
    sizes: dict[str, int] = {}
    teams = {"pursuer": scenario.tracking.pursuers.size, "evader": scenario.tracking.evaders.size}
    for team, count in teams.items():
        sizes[f"{team}.poses"] = 3 * count
        sizes |= {f"{team}.{name}": count for name in ("valid", "age", "stamp")}
    sizes |= {f"omni_camera.{name}": 1 for name in ("valid", "age", "stamp")}
    sizes["infrared.ranges"] = INFRARED * scenario.size
    sizes |= {f"infrared.{name}": scenario.size for name in ("valid", "age")}
    sizes |= {f"radio.{name}": scenario.size for name in ("quality", "battery", "state", "flags")}
    sizes["radio.counts"] = 2 * scenario.size
    sizes |= {MODE: 1, STARTS_SAID: 1, VIEW_AGE: 1}
    return sizes


def supervisor_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of every port that the supervisor fills and a log holds, by name.

    Numbers of Standing and of Reason for each robot, and the time for which robots have run [s].
    """
    return {STANDING: scenario.size, REASON: scenario.size, CLOCK: 1}


def believed_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of the ports of poses as far as they are believed, by name [m], [m], [rad]."""
    teams = scenario.tracking
    return {
        "pursuer.believed_poses": 3 * teams.pursuers.size,
        "evader.believed_poses": 3 * teams.evaders.size,
    }

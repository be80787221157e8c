"""The ports of a station, the same in every mode."""

from .scenario import StationScenario

COMMANDS = "team.velocity_commands"
SENT = "team.sent_commands"
IMAGE = "omni_camera.image"
MODE = "operator.mode"

# Sensors of a robot.
INFRARED = 4


def device_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of every port that a device fills, by name, in the order in which data flows.

    Poses are x, y [m], heading [rad]; `.valid` is 1 or 0; `.age` is the age at the last tick and
    `.stamp` the time at which it was taken [s]; ranges [m], battery [V], quality from 0 to 1.
    """
    sizes: dict[str, int] = {}
    teams = {"pursuer": scenario.tracking.pursuers.size, "evader": scenario.tracking.evaders.size}
    for team, count in teams.items():
        sizes[f"{team}.poses"] = 3 * count
        sizes |= {f"{team}.{name}": count for name in ("valid", "age", "stamp")}
    sizes |= {f"omni_camera.{name}": 1 for name in ("valid", "age", "stamp")}
    sizes["infrared.ranges"] = INFRARED * scenario.size
    sizes |= {f"infrared.{name}": scenario.size for name in ("valid", "age")}
    sizes |= {f"radio.{name}": scenario.size for name in ("quality", "battery")}
    sizes[MODE] = 1
    return sizes

"""What of the Crazyflie's protocol, CRTP, the link and the one that stands in both need.

A packet is a byte with port and channel, and up to 30 bytes. Little-endian; angles in degrees.
Source: cflib 0.1.34, and the firmware's documentation of CRTP.
"""

import struct

# Ports with their channels.
SETPOINT = (7, 0)
TABLE, SETTINGS, DATA = (5, 0), (5, 1), (5, 2)
PLATFORM_COMMAND, VERSION = (13, 0), (13, 1)
SUPERVISOR_COMMAND = (9, 1)
# What cflib's own client asks for besides: who is there, parameters, memories.
SOURCE, PARAMETERS, MEMORIES = (15, 1), (2, 0), (4, 0)

# Setpoints: nothing, and speeds over the ground at a height.
STOP, HOVER_LEGACY, HOVER = 0, 5, 10
# From these versions of the protocol on turn rates are positive to the left, and the supervisor is
# asked to arm.
LEFT_IS_POSITIVE, SUPERVISOR = 9, 12
ARM, ARM_LEGACY = 1, 1
# Of the table of what can be logged, and of logging.
ITEM, INFO = 2, 3
# How many memories there are.
COUNT = 1
START, RESET, CREATE = 3, 5, 6
# Types of values, and the supervisor's bit that motors may turn.
FLOAT, UINT16 = 7, 2
IS_ARMED = 1 << 1

# What the link logs, and its type; the values of a block in this order.
LOGGED = {
    "stateEstimate.x": FLOAT,
    "stateEstimate.y": FLOAT,
    "stateEstimate.yaw": FLOAT,
    "pm.vbat": FLOAT,
    "supervisor.info": UINT16,
}
VALUES = struct.Struct("<4fH")


def header(where: tuple[int, int]) -> int:
    """The first byte of a packet.

    Args:
        where: Port and channel.
    """
    port, channel = where
    return port << 4 | 3 << 2 | channel


def where(first: int) -> tuple[int, int]:
    """Port and channel of a packet.

    Args:
        first: Its first byte.
    """
    return first >> 4, first & 3

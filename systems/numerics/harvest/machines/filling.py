"""What a step does to combines and their tanks, exact to the moment a tank is full or empty.

Along a piece of the path the crop comes in at a constant rate, so that every load is linear
between events: the end of a piece, a full tank, an empty tank, a full cart. Each kilogram that
leaves the crop is added to one place: a tank, a cart or the ground.
"""

import numpy as np

from ...compiled import compiled

# Modes of a combine.
WAITING, CUTTING, UNLOADING, FULL, BLOCKED, DONE = range(6)
MODES = ("waiting", "cutting", "unloading", "full", "blocked", "done")

# Those in which it stands.
STANDING_MODES = (WAITING, FULL, BLOCKED, DONE)
# The same for every mode, to be looked up.
STANDS = np.isin(np.arange(len(MODES)), STANDING_MODES)

# Columns of a combine's account: way driven along its path [m]; tank, all that was cut and all
# that was spilt [kg]; time spent full and standing, spilling, and held up by others [s]; mode.
STATION, TANK, CUT, LOST, STOP_TIME, OVERFLOW_TIME, BLOCK_TIME, MODE = range(8)
COLUMNS = 8


@compiled
def advance_combine(
    account, stations, grain, speed, limit, capacity, unload_rate, room, spill, duration
):
    """Let a combine work for a while.

    Args:
        account: Its columns at the beginning, changed to those at the end, shape (8,).
        stations: Of its path, shape (n,) [m].
        grain: On each piece, shape (n - 1,) [kg].
        speed: [m/s].
        limit: Station beyond which it may not go yet [m].
        capacity: Of the tank [kg].
        unload_rate: Of the auger; 0: no cart is alongside [kg/s].
        room: What the cart alongside can still take [kg].
        spill: Whether a full combine goes on.
        duration: [s].

    Returns:
        What flowed into the cart [kg].
    """
    given = 0.0
    left = duration
    last = len(stations) - 1
    tiny = 1e-12 * duration
    piece = np.searchsorted(stations, account[STATION], side="right") - 1
    account[MODE] = CUTTING
    while left > tiny:
        tank = account[TANK]
        while piece < last and account[STATION] >= stations[piece + 1]:
            piece += 1
        done = piece >= last
        held = account[STATION] >= limit and not done
        flow = unload_rate if room - given > 0.0 else 0.0
        rate = 0.0
        moving = not done and not held
        if moving:
            rate = grain[piece] * speed / (stations[piece + 1] - stations[piece])
            # A combine whose tank is full stands, unless the auger takes more than it cuts.
            if tank >= capacity and rate > flow and not spill:
                moving, rate = False, 0.0
                account[MODE] = FULL
        out, lost = flow, 0.0
        if tank <= 0.0:
            out = min(flow, rate)
        if tank >= capacity and rate > out:
            lost = rate - out
        net = rate - out - lost
        # Until something changes.
        time = left
        ends_piece = ends_tank = ends_room = ends_limit = False
        if moving:
            to_go = stations[piece + 1] - account[STATION]
            if to_go <= speed * time:
                time, ends_piece = to_go / speed, True
            if limit - account[STATION] < speed * time:
                time, ends_piece, ends_limit = (limit - account[STATION]) / speed, False, True
        if net > 0.0 and capacity - tank < net * time:
            time, ends_tank = (capacity - tank) / net, True
        elif net < 0.0 and tank < -net * time:
            time, ends_tank = tank / -net, True
        if out > 0.0 and room - given < out * time:
            time, ends_room, ends_tank = (room - given) / out, True, False
        if ends_tank or ends_room:
            # Both come before the end of the piece, or with it.
            to_end = stations[piece + 1] - account[STATION] if piece < last else np.inf
            ends_piece = ends_piece and speed * time >= to_end
            ends_limit = ends_limit and speed * time >= limit - account[STATION]
        time = max(time, 0.0)
        amount = room - given if ends_room else out * time
        account[CUT] += rate * time
        account[LOST] += lost * time
        given += amount
        # The tank gets what is neither given nor lost; at an event it is set to the limit, and
        # what rounding leaves over (of the order of 1e-16 of it) goes where it came from.
        if ends_tank:
            target = capacity if net > 0.0 else 0.0
            account[CUT] += target - (tank + net * time)
            account[TANK] = target
        else:
            account[TANK] = tank + rate * time - amount - lost * time
        if moving:
            if ends_piece:
                account[STATION] = stations[piece + 1]
            elif ends_limit:
                account[STATION] = limit
            else:
                account[STATION] += speed * time
        elif held:
            account[BLOCK_TIME] += time
            account[MODE] = BLOCKED
        elif not done:
            account[STOP_TIME] += time
        if lost > 0.0:
            account[OVERFLOW_TIME] += time
        if out > 0.0 and moving:
            account[MODE] = UNLOADING
        left -= time
    if account[STATION] >= stations[last]:
        account[MODE] = DONE
    elif account[STATION] <= 0.0:
        account[MODE] = WAITING
    return given

"""Pictures of an omni-directional camera among walls and shells, before its sensor.

Each ray is followed to what it meets first: floor, wall, shell, or the room above.
Distances s are along the floor from the camera's axis, in the vertical plane of a ray's bearing;
the ray is at height + slope * (s - start).
"""

import math
from collections.abc import Sequence

import numpy as np

from ..compiled import compiled, kernel
from ..errors import require
from .omni_optics import SECTORS, OmniCamera, RayTable
from .surroundings import Shell, Surroundings


@compiled
def edges_by_sector(edges: np.ndarray, sectors: int) -> tuple[np.ndarray, np.ndarray]:
    """List the edges that each sector of bearing may meet.

    An edge is in every sector that it crosses, and in one more on either side for rounding; so
    looking in one sector only loses nothing.

    Args:
        edges: x0, y0, x1, y1 seen from the camera, shape (k, 4) [m].
        sectors: Number of equal sectors, from bearing -pi on.

    Returns:
        Starts of the sectors' lists, shape (sectors + 1,), and the lists, numbers of edges.
    """
    first = np.empty(len(edges), dtype=np.int64)
    count = np.empty(len(edges), dtype=np.int64)
    starts = np.zeros(sectors + 1, dtype=np.int64)
    scale = sectors / (2 * math.pi)
    for k in range(len(edges)):
        ax, ay, bx, by = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        low = math.atan2(ay, ax) + min(turn, 0.0)
        if abs(turn) > math.pi - 1e-6:
            # The camera is on the edge, to rounding: any direction may meet it.
            first[k], count[k] = 0, sectors
        else:
            begin = math.floor((low + math.pi) * scale) - 1
            end = math.floor((low + abs(turn) + math.pi) * scale) + 1
            first[k], count[k] = begin, min(end - begin + 1, sectors)
        for step in range(count[k]):
            starts[(first[k] + step) % sectors + 1] += 1
    for sector in range(sectors):
        starts[sector + 1] += starts[sector]
    lists = np.empty(starts[-1], dtype=np.int64)
    filled = starts[:-1].copy()
    for k in range(len(edges)):
        for step in range(count[k]):
            sector = (first[k] + step) % sectors
            lists[filled[sector]] = k
            filled[sector] += 1
    return starts, lists


# Rows of the palette (`Surroundings.palette`).
FLOOR, WALL, WALL_TOP, ROOM, ROBOT = 0, 2, 3, 4, 5


@kernel
def next_crossing(
    edges: np.ndarray,
    lists: np.ndarray,
    begin: int,
    end: int,
    sine: float,
    cosine: float,
    after: float,
    entering: bool,
) -> tuple[float, int]:
    """Where a bearing next crosses a wall's outline, into the wall or out of it (kernel).

    Args:
        edges: x0, y0, x1, y1 in the camera frame, free space on the left, shape (k, 4) [m].
        lists, begin, end: Numbers of the edges, shape (n,), and which of them to look at.
        sine, cosine: Of the bearing, pure numbers.
        after: Crossings up to this distance do not count [m].
        entering: Into the wall, else out of it.

    Returns:
        Distance, infinite without a crossing [m], and the edge's number.
    """
    nearest, found = math.inf, -1
    for place in range(begin, end):
        k = lists[place]
        ax, ay, bx, by = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        # Sides of the bearing's line on which the ends are; half open, so that a corner is
        # crossed once or not at all.
        side_a = cosine * ay - sine * ax
        side_b = cosine * by - sine * bx
        if (side_a > 0.0) == (side_b > 0.0):
            continue
        # From the edge's left, which is free, to its right.
        if (side_b > side_a) != entering:
            continue
        share = side_a / (side_a - side_b)
        distance = cosine * (ax + share * (bx - ax)) + sine * (ay + share * (by - ay))
        if after < distance < nearest:
            nearest, found = distance, k
    return nearest, found


@compiled
def trace(
    picture: np.ndarray,
    pixels: np.ndarray,
    sines: np.ndarray,
    cosines: np.ndarray,
    sectors: np.ndarray,
    starts: np.ndarray,
    heights: np.ndarray,
    slopes: np.ndarray,
    edges: np.ndarray,
    list_starts: np.ndarray,
    lists: np.ndarray,
    wall_height: float,
    shells: np.ndarray,
    shell_colours: np.ndarray,
    palette: np.ndarray,
    pose: np.ndarray,
    tile: float,
    light: np.ndarray,
) -> None:
    """Colour the pixels of a picture by what their rays meet.

    Args:
        picture: To be filled, shape (height * width, 3), 0 to 1.
        pixels, sines, cosines, sectors, starts, heights, slopes: As in `RayTable`.
        edges: Walls in the camera frame, shape (k, 4) [m].
        list_starts, lists: Numbers of the edges of each sector, shapes (s + 1,), (n,).
        wall_height: [m].
        shells: x, y in the camera frame, radius, base, top, shape (m, 5) [m].
        shell_colours: Shape (m, 3), 0 to 1.
        palette: Of the surroundings, shape (7, 3).
        pose: Of the camera in the world, x, y [m], heading [rad], shape (3,).
        tile: Side of the floor's tiles [m].
        light: Direction to the light in the camera frame, and the shading, shape (3,).
    """
    turn_cosine, turn_sine = math.cos(pose[2]), math.sin(pose[2])
    for n in range(len(pixels)):
        sine, cosine, slope = sines[n], cosines[n], slopes[n]
        start, height = starts[n], heights[n]
        # The floor, or nothing.
        hit = start - height / slope if slope < 0.0 else math.inf
        what, facing = (FLOOR, 0.0) if slope < 0.0 else (ROOM, 0.0)
        shell = -1
        # Shells: the side where the ray enters the cylinder, or the top where it sinks into it.
        for m in range(len(shells)):
            x, y, radius, top = shells[m, 0], shells[m, 1], shells[m, 2], shells[m, 4]
            aside = cosine * y - sine * x
            if abs(aside) >= radius:
                continue
            along, half = cosine * x + sine * y, math.sqrt(radius * radius - aside * aside)
            near, far = along - half, along + half
            if far <= start or near >= hit:
                continue
            entry = max(near, start)
            level = height + slope * (entry - start)
            if level <= top:
                # A mirror inside a shell sees nothing of its inside.
                if near < start or level < 0.0:
                    continue
                hit, shell = near, m
                what = ROBOT if level < shells[m, 3] else -1
                normal_x, normal_y = near * cosine - x, near * sine - y
                facing = (normal_x * light[0] + normal_y * light[1]) / radius
            elif slope < 0.0:
                sunk = start + (top - height) / slope
                if sunk < far and sunk < hit:
                    hit, shell, what, facing = sunk, m, ROBOT, 1.0
        # Walls nearer than that: the side where the ray runs into one, or its top.
        begin, end, after = int(list_starts[sectors[n]]), int(list_starts[sectors[n] + 1]), 0.0
        while True:
            entry, k = next_crossing(edges, lists, begin, end, sine, cosine, after, True)
            if entry >= hit:
                break
            if entry > start and height + slope * (entry - start) <= wall_height:
                hit, shell, what = entry, -1, WALL
                ex, ey = edges[k, 2] - edges[k, 0], edges[k, 3] - edges[k, 1]
                facing = (ex * light[1] - ey * light[0]) / math.hypot(ex, ey)
                break
            after, k = next_crossing(edges, lists, begin, end, sine, cosine, entry, False)
            sunk = start + (wall_height - height) / slope if slope < 0.0 else math.inf
            if sunk < after:
                if sunk < hit:
                    hit, shell, what, facing = sunk, -1, WALL_TOP, 1.0
                break
            if after == math.inf:
                break
        brightness = 1.0
        if what == FLOOR:
            x, y = hit * cosine, hit * sine
            east = pose[0] + turn_cosine * x - turn_sine * y
            north = pose[1] + turn_sine * x + turn_cosine * y
            what += (math.floor(east / tile) + math.floor(north / tile)) % 2
        elif what == WALL or shell >= 0:
            brightness = 1.0 - 0.5 * light[2] * (1.0 - facing)
        row = picture[pixels[n]]
        for channel in range(3):
            paint = shell_colours[shell, channel] if what < 0 else palette[what, channel]
            row[channel] = brightness * paint


# Row of the palette for pixels that show no mirror.
_BACKDROP = 6


def render(
    camera: OmniCamera,
    rays: RayTable,
    surroundings: Surroundings,
    pose: Sequence[float] | np.ndarray,
    shells: Sequence[Shell],
    positions: np.ndarray,
) -> np.ndarray:
    """What the camera sees: one exact ray for each pixel, and whatever it meets first.

    Args:
        camera: Whose picture.
        rays: Its own, from `make_ray_table`.
        surroundings: Floor and walls.
        pose: Of the camera: x, y [m] in free space, heading [rad], shape (3,).
        shells: Of robots; one around the camera itself is seen from above.
        positions: Of the shells' axes, shape (m, 2) [m].

    Returns:
        Light on the sensor, shape (height, width, 3), red, green and blue from 0 to 1.

    Raises:
        InvalidInput: The shells and their positions differ in number.
    """
    x, y, heading = (float(value) for value in pose)
    positions = np.asarray(positions, dtype=float).reshape(-1, 2)
    require(len(positions) == len(shells), "positions", f"be {len(shells)}", len(positions))
    # From the world to the camera frame.
    cosine, sine = math.cos(heading), math.sin(heading)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    edges = ((surroundings.world.edges.reshape(-1, 2, 2) - [x, y]) @ turn).reshape(-1, 4)
    sizes = np.array([(each.radius, each.base, each.top) for each in shells]).reshape(-1, 3)
    colours = np.array([each.colour for each in shells], dtype=np.float32).reshape(-1, 3) / 255
    angle = surroundings.light_heading - heading
    picture = np.empty((camera.height * camera.width, 3), dtype=np.float32)
    picture[:] = surroundings.palette[_BACKDROP]
    trace(
        picture,
        *rays,
        edges,
        *edges_by_sector(edges, SECTORS),
        surroundings.wall_height,
        np.hstack([(positions - [x, y]) @ turn, sizes]),
        colours,
        surroundings.palette,
        np.array([x, y, heading]),
        surroundings.tile,
        np.array([math.cos(angle), math.sin(angle), surroundings.shading]),
    )
    return picture.reshape(camera.height, camera.width, 3)

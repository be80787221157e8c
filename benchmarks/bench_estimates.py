"""Whether estimates of shells know how good they are, on pictures that get worse and worse.

For each way to spoil a picture, the mean of the normalised squared error (NEES), which is 2 for
honest covariances in the plane, over the same scenes; then what is made of decoys, of the shell's
colour but not of its shape.

    make bench ARGS="-k estimates"                          # 300 scenes a row
    SIGHTFIELD_SCENES=60 make bench ARGS="-k estimates"
"""

import math
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache, partial

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.estimation.calibration import (
    THESIS_DISTANCES,
    Calibration,
    calibrate,
)
from sightfield.systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from sightfield.systems.numerics.vision.estimation.shell_detection import chosen_colours
from sightfield.systems.numerics.vision.estimation.shell_estimate import (
    ShellEstimate,
    locate,
    search_shells,
)
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, make_ray_table, pixel_rays
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import Sensor, expose
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings

pytestmark = pytest.mark.benchmarks

SCENES = int(os.environ.get("SIGHTFIELD_SCENES", "300"))
SEED = int(os.environ.get("SIGHTFIELD_SEED", "0"))
CAMERA, SENSOR, SHELL, RED = OmniCamera(), Sensor(), Shell(), chosen_colours(["red"])
ROOM = Surroundings(world=make_world([[-3, -3], [3, -3], [3, 3], [-3, 3]], []))
# Distances from the camera to the shell's axis [m].
NEAREST, FARTHEST = 0.45, 1.6

Spoil = Callable[[np.ndarray, int], np.ndarray]


def taken(light: np.ndarray, frame: int, **changes: float) -> np.ndarray:
    """The picture of a sensor that differs in something from the calibrated one."""
    return expose(replace(SENSOR, **changes), light, frame)[:, :, :3]


def moved(light: np.ndarray, frame: int, way: float) -> np.ndarray:
    """The picture of a scene that goes on by so many pixels, anywhere, while it is taken."""
    heading = np.random.default_rng([1, frame]).uniform(0, math.pi)
    half, fine = math.ceil(0.5 * way) + 1, 9
    kernel = np.zeros((2 * half + 1, 2 * half + 1), np.float32)
    for share in (np.arange(fine * way) + 0.5) / (fine * way) - 0.5:
        x, y = half + share * way * math.cos(heading), half + share * way * math.sin(heading)
        left, top = math.floor(x), math.floor(y)
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            weight = (1 - abs(x - left - dx)) * (1 - abs(y - top - dy))
            kernel[top + dy, left + dx] += weight
    return taken(cv2.filter2D(light, -1, kernel / kernel.sum()), frame)


def packed(light: np.ndarray, frame: int, quality: int) -> np.ndarray:
    """The picture after it has been a JPEG file."""
    _, file = cv2.imencode(".jpg", taken(light, frame), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return cv2.imdecode(file, cv2.IMREAD_COLOR)


def bent(light: np.ndarray, frame: int, gamma: float) -> np.ndarray:
    """The picture of a sensor whose response is a power of the light, and not linear."""
    shares = taken(light, frame) / 255
    return np.round(255 * shares**gamma).astype(np.uint8)


ROWS: dict[str, Spoil] = {
    "as calibrated": taken,
    **{f"noise {n}": partial(taken, noise=n) for n in (6.0, 9.0, 12.0)},
    **{f"blur {b} px": partial(taken, blur=b) for b in (1.0, 1.5, 2.0, 3.0)},
    **{f"motion {w} px": partial(moved, way=w) for w in (3, 6, 9, 12)},
    **{f"JPEG {q}": partial(packed, quality=q) for q in (95, 75, 50, 25)},
    **{f"exposure {e}": partial(taken, exposure=e) for e in (0.2, 0.5, 2.0, 3.0, 4.0)},
    **{f"gamma {g}": partial(bent, gamma=g) for g in (0.45, 0.7, 1.5, 2.2)},
}


@cache
def known() -> Calibration:
    """The calibration of the sensor as it is, of 15 directions."""
    pictures = simulated_pictures(CAMERA, SENSOR, SHELL, distances=THESIS_DISTANCES, directions=15)
    sizes = {"base": SHELL.base, "shell_radius": SHELL.radius, "shell_top": SHELL.top}
    rough = OmniCamera(pinhole_height=0.24, focal_length=800.0)
    readings, _ = read_pictures(pictures, rough, *RED, **sizes)
    return calibrate(readings, camera=rough, **sizes)


@dataclass
class Score:
    """What came of a row's scenes."""

    squares: list[float] = field(default_factory=list)
    misses: list[float] = field(default_factory=list)
    refusals: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    def add(self, estimate: ShellEstimate, pose: np.ndarray, spot: np.ndarray) -> None:
        """Count a scene."""
        if not estimate.outcome.has_estimate:
            self.refusals[estimate.outcome.words] += 1
            return
        position, covariance = locate(estimate, pose, SHELL.radius)
        off = position - spot
        self.squares.append(float(off @ np.linalg.solve(covariance, off)))
        self.misses.append(float(np.linalg.norm(off)))

    @property
    def line(self) -> str:
        """Mean NEES with twice its standard error, rms error, refused share with the reasons."""
        squares, count = np.array(self.squares), len(self.squares) + self.refusals.total()
        reasons = ", ".join(f"{words} {n}" for words, n in self.refusals.most_common())
        if not len(squares):
            return f"- | - | 100% | {reasons}"
        doubt = 2 * squares.std(ddof=1) / math.sqrt(len(squares)) if len(squares) > 1 else math.inf
        rms = 1000 * math.sqrt(np.mean(np.square(self.misses)))
        share = self.refusals.total() / count
        return f"{squares.mean():.2f} +- {doubt:.2f} | {rms:.1f} mm | {share:.1%} | {reasons}"


def scenes(count: int) -> Iterator[tuple[int, np.ndarray, np.ndarray, np.ndarray]]:
    """Number, pose of the camera, place of the shell, and light of random scenes."""
    rays = make_ray_table(CAMERA)
    for frame in range(count):
        random = np.random.default_rng([SEED, frame])
        pose = random.uniform([-1, -1, -math.pi], [1, 1, math.pi])
        reach, way = random.uniform(NEAREST, FARTHEST), random.uniform(-math.pi, math.pi)
        spot = pose[:2] + reach * np.array([math.cos(way), math.sin(way)])
        yield frame, pose, spot, render(CAMERA, rays, ROOM, pose, [SHELL], spot[None])


def test_errors_against_what_covariances_say():
    scores, calibration = {name: Score() for name in ROWS}, known()
    for frame, pose, spot, light in scenes(SCENES):
        for name, spoil in ROWS.items():
            picture = spoil(light, frame)
            began = time.process_time()
            ((_, estimate),) = search_shells(picture, RED, calibration)
            scores[name].seconds += time.process_time() - began
            scores[name].add(estimate, pose, spot)
    print(f"\n{SCENES} scenes a row: NEES | rms error | refused | CPU time of a picture")
    for name, score in scores.items():
        print(f"  {name:14s} {score.line} | {1000 * score.seconds / SCENES:.1f} ms")


@dataclass(frozen=True)
class Block:
    """An upright box: a crate, a mat if it is low, a poster if it is thin and off the floor."""

    distance: float
    bearing: float
    turn: float
    depth: float
    width: float
    bottom: float
    top: float

    def paint(self, light: np.ndarray) -> np.ndarray:
        """Put it into a picture whose camera is in the origin, in front of all else."""
        points, ways = _rays()
        heading = self.bearing + self.turn
        turn = np.array(
            [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
        )
        middle = self.distance * np.array([math.cos(self.bearing), math.sin(self.bearing)])
        start = np.column_stack([(points[:, :2] - middle) @ turn, points[:, 2]])
        along = np.column_stack([ways[:, :2] @ turn, ways[:, 2]])
        along[along == 0] = 1e-12
        half = np.array([0.5 * self.depth, 0.5 * self.width])
        low, high = np.array([*-half, self.bottom]), np.array([*half, self.top])
        one, other = (low - start) / along, (high - start) / along
        entries, leaves = np.minimum(one, other), np.maximum(one, other).min(axis=1)
        side, entry = entries.argmax(axis=1), entries.max(axis=1)
        hit = (entry > 0) & (entry < leaves)
        normals = np.zeros((len(side), 2))
        for axis in (0, 1):
            normals[side == axis, axis] = -np.sign(along[side == axis, axis])
        sun = np.array([math.cos(ROOM.light_heading), math.sin(ROOM.light_heading)])
        facing = np.where(side == 2, 1.0, (normals @ turn.T) @ sun)
        shade = 1 - 0.5 * ROOM.shading * (1 - facing)
        flat = light.reshape(-1, 3).copy()
        flat[_seen()[hit]] = shade[hit, None] * np.array(SHELL.colour) / 255
        return flat.reshape(light.shape).astype(np.float32)


@cache
def _seen() -> np.ndarray:
    """Numbers of the pixels that show the mirror."""
    return make_ray_table(CAMERA).pixels


@cache
def _rays() -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.divmod(_seen(), CAMERA.width)
    return pixel_rays(CAMERA, np.column_stack([columns, rows]))


def box(random: np.random.Generator) -> Block:
    """A crate on the floor, about as large as a shell."""
    return Block(
        distance=random.uniform(NEAREST, FARTHEST),
        bearing=random.uniform(-math.pi, math.pi),
        turn=random.uniform(-math.pi, math.pi),
        depth=random.uniform(0.12, 0.3),
        width=random.uniform(0.12, 0.3),
        bottom=0.0,
        top=random.uniform(0.1, 0.3),
    )


def mat(random: np.random.Generator) -> Block:
    """A thing that lies on the floor."""
    distance = random.uniform(NEAREST + 0.1, FARTHEST)
    return replace(
        box(random),
        distance=distance,
        depth=random.uniform(0.15, 0.5),
        width=random.uniform(0.15, 0.5),
        top=0.003,
    )


def poster(random: np.random.Generator) -> Block:
    """A sheet on a wall, seen at up to 45 degrees."""
    bottom = random.uniform(0.0, 0.2)
    return replace(
        box(random),
        turn=random.uniform(-0.25 * math.pi, 0.25 * math.pi),
        depth=0.002,
        width=random.uniform(0.15, 0.4),
        bottom=bottom,
        top=bottom + random.uniform(0.1, 0.3),
    )


@pytest.mark.parametrize("decoy", [box, mat, poster])
def test_decoys(decoy):
    rays, found = make_ray_table(CAMERA), Counter()
    empty = render(CAMERA, rays, ROOM, np.zeros(3), [], np.empty((0, 2)))
    for frame in range(SCENES):
        light = decoy(np.random.default_rng([2, frame])).paint(empty)
        ((_, estimate),) = search_shells(taken(light, frame), RED, known())
        found[estimate.outcome.words if not estimate.outcome.has_estimate else "accepted"] += 1
    reasons = ", ".join(f"{words} {n}" for words, n in found.most_common() if words != "accepted")
    share = found["accepted"] / SCENES
    print(
        f"\n  {decoy.__name__}: accepted {found['accepted']} of {SCENES} ({share:.1%}) | {reasons}"
    )

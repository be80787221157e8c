"""The log of a harvest, read from its two files for an audit, and the faults found in it."""

import json
import math
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from ...errors import InvalidInput, require

# Faults of one kind that are less than this apart in time are merged [s].
APART = 2.0

LOG_FILE, MACHINES_FILE = "log.npz", "machines.json"

# Arrays of the log, with their dimensions after the first, time; "N" combines, "K" carts.
ARRAYS: dict[str, tuple[str | int, ...]] = {
    "time": (),
    "combine_pose": ("N", 3),
    "combine_speed": ("N",),
    "tractor_pose": ("K", 3),
    "trailer_pose": ("K", 3),
    "tank": ("N",),
    "cart_load": ("K",),
    "cutting": ("N",),
    "delivered": (),
}

# Coordinates beyond this belong to no field, and are not exact [m].
FAR = 1e6


class AuditFault(NamedTuple):
    """Something that is not as it must be.

    Attributes:
        kind: What is wrong, as "machines too near".
        machines: Those involved, as ("combine 0", "cart 1"); empty if it concerns all.
        begin: When it begins [s].
        end: When it ends [s].
        time: When it is worst [s].
        amount: How much it is then, in `unit` [-].
        limit: The most or the least that it may be, in `unit` [-].
        unit: Of amount and limit.
    """

    kind: str
    machines: tuple[str, ...]
    begin: float
    end: float
    time: float
    amount: float
    limit: float
    unit: str


def spells(wrong: np.ndarray, time: np.ndarray) -> Iterator[tuple[int, int]]:
    """Runs of intervals that are wrong; runs less than APART from each other are merged.

    Args:
        wrong: Whether each interval between two samples is wrong, shape (T - 1,).
        time: Of the samples, shape (T,) [s].

    Yields:
        The first interval, and the one after the last.
    """
    numbers = np.flatnonzero(wrong)
    if len(numbers) == 0:
        return
    breaks = np.flatnonzero(time[numbers[1:]] - time[numbers[:-1] + 1] >= APART) + 1
    for run in np.split(numbers, breaks):
        yield int(run[0]), int(run[-1]) + 1


def faults_where(
    kind: str,
    machines: tuple[str, ...],
    amounts: np.ndarray,
    limits: np.ndarray | float,
    unit: str,
    time: np.ndarray,
    *,
    at_end: bool = False,
) -> list[AuditFault]:
    """A fault for every spell in which amounts are beyond their limits.

    Args:
        kind: Of the faults.
        machines: Those involved.
        amounts: By interval, shape (n,); wrong where they are greater than their limits.
        limits: Largest amounts allowed, shape (n,) or one for all.
        unit: Of amounts and limits.
        time: Of the samples, shape (n + 1,) [s].
        at_end: Whether an interval's amount occurs at its end rather than at its beginning.
    """
    bounds = np.broadcast_to(limits, amounts.shape)
    found = []
    for first, last in spells(amounts > bounds, time):
        worst = first + int(np.argmax((amounts - bounds)[first:last]))
        found.append(
            AuditFault(
                kind,
                machines,
                float(time[first]),
                float(time[last]),
                float(time[worst + at_end]),
                float(amounts[worst]),
                float(bounds[worst]),
                unit,
            )
        )
    return found


@dataclass(frozen=True, eq=False)
class HarvestLog:
    """What N combines and K carts did, in T samples.

    Between two samples every pose follows a constant twist: along an arc or a straight, turning
    the shorter way round.

    Attributes:
        time: Increasing, shape (T,) [s].
        combine_pose: x, y, theta of the frame of the outlines, shape (T, N, 3) [m], [m], [rad].
        combine_speed: Along the path; backwards with either sign, shape (T, N) [m/s].
        tractor_pose: Shape (T, K, 3) [m], [m], [rad].
        trailer_pose: Shape (T, K, 3) [m], [m], [rad].
        tank: Grain in each combine, shape (T, N) [kg].
        cart_load: Grain in each cart, shape (T, K) [kg].
        cutting: Whether the header is down, 1 or 0, shape (T, N).
        delivered: Grain that all carts have delivered at the edge of the field, shape (T,) [kg].
    """

    time: np.ndarray
    combine_pose: np.ndarray
    combine_speed: np.ndarray
    tractor_pose: np.ndarray
    trailer_pose: np.ndarray
    tank: np.ndarray
    cart_load: np.ndarray
    cutting: np.ndarray
    delivered: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Machine:
    """A combine or a cart: its two outlines, and its limits as far as they are known.

    Attributes:
        front: Corners of the header, or of the tractor, in the frame of its pose, shape (m, 2) [m].
        rear: Corners of the body, or of the trailer, shape (m, 2) [m].
        capacity: Grain that it holds; infinite if not stated [kg].
        acceleration: Largest along the way; infinite if not stated [m/s^2].
        lateral_acceleration: Largest across the way; infinite if not stated [m/s^2].
        turning_radius: Smallest; 0 if not stated [m].
    """

    front: np.ndarray
    rear: np.ndarray
    capacity: float = math.inf
    acceleration: float = math.inf
    lateral_acceleration: float = math.inf
    turning_radius: float = 0.0


class Part(NamedTuple):
    """A part of a field: crop grows within its boundary, but for the holes.

    Attributes:
        boundary: A simple polygon [m].
        holes: In it; they may touch or overlap [m].
        no_go: Polygons that nothing may drive on, wherever they are [m].
    """

    boundary: shapely.Polygon
    holes: tuple[shapely.Polygon, ...]
    no_go: tuple[shapely.Polygon, ...] = ()


class SiteYields(NamedTuple):
    """Yield in square cells; beyond them the nearest cell counts.

    Attributes:
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Of a cell [m].
        values: Rows from south to north, shape (rows, columns) [kg/m^2].
    """

    corner: np.ndarray
    side: float
    values: np.ndarray

    def at(self, places: np.ndarray) -> np.ndarray:
        """Grain at places, shape (n, 2) [m] -> (n,) [kg/m^2]."""
        last = np.array(self.values.shape[::-1]) - 1
        cells = np.clip((places - self.corner) // self.side, 0, last).astype(int)
        return self.values[cells[:, 1], cells[:, 0]]


@dataclass(frozen=True, eq=False)
class Site:
    """The machines and the ground that they work on.

    Attributes:
        combines: N of them.
        carts: K of them.
        parts: Of the field.
        margin: How far outside of the boundaries machines may drive [m].
        density: Grain on the ground; NaN if not stated [kg/m^2].
        yields: The same place by place, which takes precedence over the density.
    """

    combines: tuple[Machine, ...]
    carts: tuple[Machine, ...]
    parts: tuple[Part, ...]
    margin: float
    density: float = math.nan
    yields: SiteYields | None = None


def read_harvest(folder: str | Path) -> tuple[HarvestLog, Site]:
    """Read `log.npz` and `machines.json` of a folder.

    Raises:
        InvalidInput: A file is missing or damaged, an array or a key is missing, has another shape
            than the machines ask for, or is not finite; times do not increase; an outline or a
            boundary crosses itself.
    """
    folder = Path(folder)
    require(folder.is_dir(), "folder", "be a folder with a log", folder)
    site = _read_site(folder / MACHINES_FILE)
    return _read_log(folder / LOG_FILE, len(site.combines), len(site.carts)), site


def _read_log(path: Path, combines: int, carts: int) -> HarvestLog:
    arrays: dict[str, np.ndarray] = {}
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            require(isinstance(archive, np.lib.npyio.NpzFile), LOG_FILE, "be an archive", path)
            for name in ARRAYS:
                require(name in archive.files, LOG_FILE, f"hold `{name}`", sorted(archive.files))
                arrays[name] = archive[name]
    except InvalidInput:
        raise
    except OSError as error:
        raise InvalidInput(f"`{LOG_FILE}` must be readable; got {path}: {error.strerror}") from None
    except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError) as error:
        raise InvalidInput(f"`{LOG_FILE}` must be whole; got {path}: {error}") from None
    except (ValueError, TypeError, KeyError, AttributeError, SyntaxError, MemoryError):
        raise InvalidInput(f"`{LOG_FILE}` must hold arrays of numbers; got {path}") from None
    samples = arrays["time"].shape[0] if arrays["time"].ndim == 1 else -1
    require(samples >= 2, "time", "have shape (T,), T at least 2", arrays["time"].shape)
    sizes = {"N": combines, "K": carts}
    for name, row in ARRAYS.items():
        shape = (samples, *(sizes.get(str(each), each) for each in row))
        got = arrays[name]
        require(got.dtype.kind in "fiub", name, "hold real numbers", got.dtype)
        require(got.shape == shape, name, f"have shape {shape}", got.shape)
        arrays[name] = got.astype(float)
        require(bool(np.isfinite(arrays[name]).all()), name, "be finite", "NaN or infinity")
    for name in ("combine_pose", "tractor_pose", "trailer_pose"):
        far = float(np.abs(arrays[name]).max(initial=0.0))
        require(far < FAR, name, f"lie within {FAR:g} m, in local metres", far)
    steps = np.diff(arrays["time"])
    require(bool((steps > 0).all()), "time", "increase", f"{steps.min()} between two samples")
    wrong = set(np.unique(arrays["cutting"])) - {0.0, 1.0}
    require(not wrong, "cutting", "be 0 or 1", sorted(wrong)[:3])
    return HarvestLog(**arrays)


def _read_site(path: Path) -> Site:
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidInput(
            f"`{MACHINES_FILE}` must be readable; got {path}: {error.strerror}"
        ) from None
    except (ValueError, RecursionError) as error:
        line = str(error).splitlines()[0]
        raise InvalidInput(f"`{MACHINES_FILE}` must be JSON; got {path}: {line}") from None
    return site_of(about)


def site_of(about: Any) -> Site:
    """The site that the contents of `machines.json` describe.

    Args:
        about: The contents as they come from JSON.

    Raises:
        InvalidInput: See `read_harvest`.
    """
    require(isinstance(about, dict), MACHINES_FILE, "be an object", type(about).__name__)
    combines = _entries(about, "combines")
    carts = _entries(about, "carts")
    parts = _entries(about, "parts")
    require(len(parts) > 0, "parts", "be at least one", 0)
    require(len(combines) + len(carts) > 0, "combines", "be at least one machine", 0)
    density = _number(about, "density", "", math.nan)
    return Site(
        tuple(_machine(c, f"combines[{n}]", "header", "body") for n, c in enumerate(combines)),
        tuple(_machine(c, f"carts[{k}]", "tractor", "trailer") for k, c in enumerate(carts)),
        tuple(_part(part, f"parts[{i}]") for i, part in enumerate(parts)),
        _number(about, "margin", "", None),
        density,
        _yields(about.get("yields")),
    )


def _yields(about: Any) -> SiteYields | None:
    if about is None:
        return None
    require(isinstance(about, dict), "yields", "be an object", _shown(about))
    corner, values = _numbers(about, "corner"), _numbers(about, "values")
    require(corner.shape == (2,), "yields.corner", "be a point", _shown(about.get("corner")))
    cells = values.ndim == 2 and values.size > 0 and bool((values >= 0).all())
    require(cells, "yields.values", "be rows of numbers, zero or positive", values.shape)
    side = _number(about, "side", "yields.", None)
    require(side > 0, "yields.side", "be positive", side)
    return SiteYields(corner, side, values)


def _numbers(about: dict[str, Any], key: str) -> np.ndarray:
    try:
        numbers = np.array(about.get(key), dtype=float)
    except (TypeError, ValueError, OverflowError):
        numbers = np.array(np.nan)
    finite = bool(np.isfinite(numbers).all())
    require(finite, f"yields.{key}", "be numbers", _shown(about.get(key)))
    return numbers


def _entries(about: dict[str, Any], name: str) -> list[dict[str, Any]]:
    found = about.get(name)
    require(isinstance(found, list), name, "be a list of objects", _shown(found))
    assert isinstance(found, list)
    for i, each in enumerate(found):
        require(isinstance(each, dict), f"{name}[{i}]", "be an object", _shown(each))
    return found


def _machine(entry: dict[str, Any], name: str, front: str, rear: str) -> Machine:
    limits = {
        "capacity": math.inf,
        "acceleration": math.inf,
        "lateral_acceleration": math.inf,
        "turning_radius": 0.0,
    }
    return Machine(
        front=_ring(entry.get(front), f"{name}.{front}"),
        rear=_ring(entry.get(rear), f"{name}.{rear}"),
        **{key: _number(entry, key, f"{name}.", default) for key, default in limits.items()},
    )


def _part(entry: dict[str, Any], name: str) -> Part:
    boundary = shapely.Polygon(_ring(entry.get("boundary"), f"{name}.boundary"))
    holes, no_go = (_polygons(entry, name, key) for key in ("holes", "no_go"))
    for i, hole in enumerate(holes):
        outside = hole.difference(boundary).area
        least = 1e-6 * boundary.area
        require(outside <= least, f"{name}.holes[{i}]", "lie inside", f"{outside:.3g} m^2 outside")
    return Part(boundary, tuple(holes), tuple(no_go))


def _polygons(entry: dict[str, Any], name: str, key: str) -> list[shapely.Polygon]:
    rings = entry.get(key, [])
    require(isinstance(rings, list), f"{name}.{key}", "be a list of rings", _shown(rings))
    return [shapely.Polygon(_ring(ring, f"{name}.{key}[{i}]")) for i, ring in enumerate(rings)]


def _ring(points: Any, name: str) -> np.ndarray:
    """Corners of a simple polygon, counterclockwise, shape (m, 2) [m]."""
    try:
        ring = np.array(points, dtype=float)
    except (TypeError, ValueError):
        ring = np.zeros(0)
    fits = ring.ndim == 2 and ring.shape[-1] == 2
    require(fits, name, "be a list of points [x, y]", _shown(points))
    inside = bool(np.isfinite(ring).all()) and float(np.abs(ring).max(initial=0.0)) < FAR
    require(inside, name, f"be finite and within {FAR:g} m", _shown(points))
    ring = ring[np.any(ring != np.roll(ring, 1, axis=0), axis=1)]
    require(len(ring) >= 3, name, "have at least three corners", len(ring))
    polygon = shapely.Polygon(ring)
    whole = polygon.is_valid and polygon.area > 1e-9
    require(whole, name, "be a polygon that does not cross itself", _shown(points))
    return ring if polygon.exterior.is_ccw else ring[::-1].copy()


def _number(entry: dict[str, Any], key: str, prefix: str, default: float | None) -> float:
    """A number from JSON, required unless it has a default; null stands for the default."""
    value = entry.get(key)
    if value is None and default is not None:
        return default
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        number = float(value) if abs(value) < 1e300 else math.inf
        if math.isfinite(number) and number >= 0:
            return number
    raise InvalidInput(
        f"`{prefix}{key}` must be a finite number, zero or positive; got {_shown(value)}"
    )


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."

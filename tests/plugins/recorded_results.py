"""Results as they were recorded: what a case gave when somebody looked at it, it gives today.

A test says `as_recorded(value)`. What was recorded lies beside it, in `recorded/`, a file for each
file of tests, and is compared number by number. Where a change of results is meant, `make record`
writes it anew, and its diff shows what is otherwise.

Arrays of many numbers are kept as a digest: their shape, some of them, and sums with fixed weights,
which nothing but the same numbers in the same order gives.
"""

import dataclasses
import enum
import fcntl
import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_pictures import Drawn

# With this in the environment results are recorded, and not compared.
RECORD = "SIGHTFIELD_RECORD"

# How far two runs of one code may lie apart, on machines with other processors.
RELATIVE, ABSOLUTE = 1e-6, 1e-9

# Larger arrays are kept as a digest, with so many of their first and last numbers.
_WHOLE, _ENDS, _SUMS = 24, 3, 2

# Longer texts are kept line by line, so that a diff shows which of them changed.
_LONG_TEXT = 200

# How numbers are written, and how wide a file is.
_DIGITS, _WIDTH = 10, 100

# How many differences a failure lists.
_LISTED = 12


@pytest.fixture
def as_recorded(request: pytest.FixtureRequest) -> Callable[..., None]:
    """A function of a result, which must be as it was recorded for this test.

    Its `relative` and `absolute` tolerances may be said where a result is less certain than to
    1e-6; a test that asks twice names what it asks for.
    """
    file = request.path.parent / "recorded" / f"{request.path.stem}.json"

    def check(
        value: object, name: str = "", relative: float = RELATIVE, absolute: float = ABSOLUTE
    ) -> None:
        key = f"{request.node.name} {name}".strip()
        plain = to_plain(value)
        if os.environ.get(RECORD):
            _write(file, key, plain)
            return
        recorded = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        assert key in recorded, f"nothing is recorded for {key}: see `make record`"
        differences = list(differences_of(recorded[key], plain, relative, absolute))
        if differences:
            said = "\n".join(differences[:_LISTED])
            pytest.fail(f"{len(differences)} differences from what is recorded:\n{said}")

    return check


@pytest.fixture
def saved_pictures(monkeypatch: pytest.MonkeyPatch) -> dict[str, Drawn]:
    """What is drawn on each figure that is saved, by the name of its file."""
    from matplotlib.figure import Figure

    saved: dict[str, Drawn] = {}
    save = Figure.savefig

    def savefig(figure: Figure, path: Any, *args: object, **options: object) -> None:
        save(figure, path, *args, **options)
        name = getattr(path, "name", str(path))
        saved[Path(name).name if isinstance(name, str) else str(len(saved))] = Drawn(figure)

    monkeypatch.setattr(Figure, "savefig", savefig)
    return saved


@pytest.fixture
def meshcat_calls(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What every Meshcat is told, by the name of its function and the path.

    For each: how often, what it was told first, and the numbers that it was told then.
    """
    from pydrake.geometry import Meshcat, MeshcatAnimation

    told: dict[str, Any] = {}
    for kind in (Meshcat, MeshcatAnimation):
        for name in dir(kind):
            if re.match(r"Set[A-Z]|Delete|Add[A-Z]|PlotSurface", name):
                monkeypatch.setattr(kind, name, _noted(told, name, getattr(kind, name)))
    return told


class _Told:
    """What a function was told in all its calls."""

    def __init__(self) -> None:
        self.calls: list[tuple[object, ...]] = []

    def plain(self) -> object:
        told = {"calls": len(self.calls), "first": to_plain(self.calls[0])}
        numbers = [each for call in self.calls[1:] for each in _numbers(call)]
        return told | ({"then": to_plain(np.array(numbers))} if numbers else {})


def _noted(told: dict[str, Any], name: str, call: Callable[..., object]) -> Callable[..., object]:
    def note(self: object, *args: Any, **options: Any) -> object:
        said = (*args, *options.values())
        paths = [each for each in said if isinstance(each, str)]
        # What lies in many numbered places is one thing.
        key = re.sub(r"\d+", "#", " ".join([name, *paths[:2]]))
        kept = _surface(said) if name.startswith("SetTriangle") else tuple(map(_still, said))
        told.setdefault(key, _Told()).calls.append(kept)
        return call(self, *args, **options)

    return note


def _surface(said: tuple[Any, ...]) -> tuple[object, ...]:
    """A mesh as its area, the integrals over it of its places and colours, and the rest.

    Into which triangles a flat surface is cut is another matter on another processor.
    """
    vertices, faces, *colours = (each for each in said if isinstance(each, np.ndarray))
    one, two, three = (vertices[:, each.astype(int)] for each in faces)
    areas = np.linalg.norm(np.cross(two - one, three - one, axis=0), axis=0) / 2
    integrals = [
        sum(values[:, each.astype(int)] for each in faces) @ areas / 3
        for values in (vertices, *colours)
    ]
    rest = (_still(each) for each in said if not isinstance(each, np.ndarray))
    return (*rest, np.array([areas.sum(), *np.concatenate(integrals)]))


def _still(value: Any) -> object:
    """What an argument was when it was given."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if type(value).__name__ == "Rgba":
        return [value.r(), value.g(), value.b(), value.a()]
    if hasattr(value, "GetAsMatrix34"):
        return np.array(value.GetAsMatrix34())
    if isinstance(value, str | bool | int | float | list | tuple | None):
        return value
    return repr(value) if not re.search(r" at 0x|object", repr(value)) else type(value).__name__


def _numbers(value: object) -> Iterator[float]:
    if isinstance(value, np.ndarray):
        yield from np.asarray(value, dtype=float).ravel()
    elif isinstance(value, int | float):
        yield float(value)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from _numbers(each)


def to_plain(value: Any) -> Any:
    """A result as JSON has it.

    Raises:
        TypeError: If it is of a kind whose parts are not known: record what it says of itself.
    """
    match value:
        case _ if hasattr(value, "plain"):
            return to_plain(value.plain())
        case None | bool():
            return value
        case enum.Enum():
            return value.name
        case str():
            return value.splitlines() if len(value) > _LONG_TEXT else value
        case int():
            return int(value)
        case float():
            return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else str(float(value))
        case np.generic():
            return to_plain(value.item())
        case np.ndarray():
            return _digest(value)
        case Path():
            return value.name
        case bytes():
            return _digest(np.frombuffer(value, dtype=np.uint8))
        case complex():
            return [to_plain(value.real), to_plain(value.imag)]
        case Mapping():
            return {str(to_plain(key)): to_plain(each) for key, each in value.items()}
        case Set():
            return sorted((to_plain(each) for each in value), key=repr)
        case _ if dataclasses.is_dataclass(value) and not isinstance(value, type):
            fields = [each.name for each in dataclasses.fields(value)]
            return {name: to_plain(getattr(value, name)) for name in fields}
        case tuple() if hasattr(value, "_fields"):
            return {name: to_plain(getattr(value, name)) for name in value._fields}
        case Sequence() if _are_numbers(value) and len(value) > _WHOLE:
            return _digest(np.array(value))
        case Sequence():
            return [to_plain(each) for each in value]
    raise TypeError(f"{type(value)} cannot be recorded")


def _are_numbers(value: Sequence[object]) -> bool:
    return all(isinstance(each, int | float | np.number) for each in value)


def _digest(array: np.ndarray) -> Any:
    if array.dtype == object or array.dtype.kind in "US":
        return [to_plain(each) for each in array.tolist()]
    if array.dtype.names:
        return {name: _digest(array[name]) for name in array.dtype.names}
    if array.dtype.kind == "c":
        return [_digest(array.real), _digest(array.imag)]
    if array.size <= _WHOLE:
        return to_plain(array.tolist())
    flat = np.ma.filled(np.ma.asarray(array, dtype=float).ravel(), np.nan)
    finite = np.isfinite(flat)
    values = np.where(finite, flat, 0.0)
    weights = np.random.default_rng(0).uniform(0.5, 1.5, (_SUMS, flat.size))
    return {
        "shape": list(array.shape),
        "first": to_plain(flat[:_ENDS].tolist()),
        "last": to_plain(flat[-_ENDS:].tolist()),
        "not finite": int((~finite).sum()),
        "of size": to_plain(float(np.abs(values).sum())),
        "sums": to_plain((weights @ values).tolist()),
    }


def differences_of(
    recorded: Any,
    value: Any,
    relative: float = RELATIVE,
    absolute: float = ABSOLUTE,
    at: str = "",
) -> Iterator[str]:
    """Where a result, as JSON has it, is unlike what is recorded: a line for each place."""
    match recorded, value:
        case dict(), dict():
            size = recorded.get("of size") if "sums" in recorded else None
            for key in [*recorded, *(key for key in value if key not in recorded)]:
                if key not in recorded or key not in value:
                    gone = "is missing" if key in recorded else "was not there"
                    yield f"{at}/{key}: {gone}"
                    continue
                # A sum is as sure as the size of what it adds up.
                slack = relative * size if key == "sums" and size else 0.0
                yield from differences_of(
                    recorded[key], value[key], relative, max(absolute, slack), f"{at}/{key}"
                )
        case list(), list():
            if len(recorded) != len(value):
                yield f"{at}: {len(value)} for {len(recorded)}"
            for number, (old, new) in enumerate(zip(recorded, value, strict=False)):
                yield from differences_of(old, new, relative, absolute, f"{at}/{number}")
        case (int() | float(), int() | float()) if not isinstance(recorded, bool):
            if not math.isclose(recorded, value, rel_tol=relative, abs_tol=absolute):
                yield f"{at}: {value} for {recorded}"
        case _ if recorded != value:
            yield f"{at}: {value!r} for {recorded!r}"


def _write(file: Path, key: str, plain: object) -> None:
    """Put a result into its file, which several processes may write."""
    file.parent.mkdir(exist_ok=True)
    with file.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        recorded = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        recorded[key] = plain
        file.write_text(_pretty(dict(sorted(recorded.items()))) + "\n", encoding="utf-8")
    file.with_suffix(".lock").unlink(missing_ok=True)


def _pretty(value: Any, indent: str = "") -> str:
    """JSON whose lines are filled."""
    line = json.dumps(value, ensure_ascii=False)
    if len(indent) + len(line) <= _WIDTH or not value or not isinstance(value, dict | list):
        return line
    deeper = indent + " "
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {_pretty(each, deeper)}" for key, each in value.items()]
    else:
        parts = [_pretty(each, deeper) for each in value]
    lines = [parts[0]]
    for part in parts[1:]:
        beside = f"{lines[-1]}, {part}"
        if len(deeper) + len(beside) < _WIDTH and "\n" not in beside:
            lines[-1] = beside
        else:
            lines.append(part)
    inside = f",\n{deeper}".join(lines)
    return f"{{\n{deeper}{inside}}}" if isinstance(value, dict) else f"[\n{deeper}{inside}]"

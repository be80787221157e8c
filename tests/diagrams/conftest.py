"""What a command of the program leaves, compared with what it left before."""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from drawn_pictures import Drawn
from matplotlib.figure import Figure
from PIL import Image
from pydrake.systems.framework import Diagram
from recorded_results import to_plain

# What hangs on the machine, not on what was asked.
UNSURE = re.compile(r"wall.?time|realtime.?factor|cpu.?seconds|recalled|megabytes", re.I)

# Of one kind on a picture, more than so many are told in short.
SEVERAL = 1

# Arrays up to this size are kept whole by `as_recorded`.
FEW = 24


def inputs_that_nothing_leads_to(diagram: Diagram) -> Iterator[str]:
    """Paths of the inputs that nothing leads to, of systems at any depth."""
    led = {(system.get_name(), int(port)) for system, port in diagram.connection_map()}
    for number in range(diagram.num_input_ports()):
        index = diagram.get_input_port(number).get_index()
        led |= {(each.get_name(), int(port)) for each, port in diagram.GetInputPortLocators(index)}
    for system in diagram.GetSystems():
        for number in range(system.num_input_ports()):
            if (system.get_name(), number) not in led:
                yield f"{system.get_name()}.{system.get_input_port(number).get_name()}"
        if isinstance(system, Diagram):
            yield from (
                f"{system.get_name()}/{each}" for each in inputs_that_nothing_leads_to(system)
            )


@pytest.fixture
def as_it_was(
    sightfield_here, tmp_path, monkeypatch, as_recorded, saved_pictures, meshcat_calls
) -> Callable[..., None]:
    """A function of words after `sightfield`: what it says, draws and leaves is as recorded.

    Its `code` is the exit code that is due, its `out` whether a folder is asked for; the parts
    and pictures named in `besides` are not looked at.
    """

    def check(
        *words: object,
        code: int = 0,
        out: bool = True,
        besides: tuple[str, ...] = (),
        relative: float = 1e-6,
    ) -> None:
        monkeypatch.setenv("COLUMNS", "100")
        folder = tmp_path / "out"
        done = sightfield_here(*words, *(("--out", folder) if out else ()))
        assert done.returncode == code, done.stdout + done.stderr
        parts = {
            "said": _said(done.stdout, tmp_path),
            "pictures": {
                name: drawn_on(each) for name, each in saved_pictures.items() if name not in besides
            },
            "scene": told_of(meshcat_calls),
            "files": left_in(folder),
        }
        for name, part in parts.items():
            if name not in besides and part:
                as_recorded(part, name, relative=relative)

    return check


@pytest.fixture(scope="session")
def unconnected() -> Callable[[Diagram], list[str]]:
    """Paths of a diagram's inputs that are not connected: one that is forgotten has a default."""
    return lambda diagram: list(inputs_that_nothing_leads_to(diagram))


@pytest.fixture
def told() -> Callable[[dict[str, Any]], dict[str, Any]]:
    """See `told_of`."""
    return told_of


@pytest.fixture
def drawn() -> Callable[[Figure | Drawn], dict[str, Any]]:
    """What is drawn on a figure, or was on one that is saved; see `drawn_on`."""
    return lambda figure: drawn_on(figure if isinstance(figure, Drawn) else Drawn(figure))


def told_of(calls: dict[str, Any]) -> dict[str, Any]:
    """What Meshcat was told, of each kind of call and path: how often, and `_in_short` what."""
    return {key: {"calls": len(each.calls), **_in_short(each.calls)} for key, each in calls.items()}


def drawn_on(figure: Drawn) -> dict[str, Any]:
    """What is drawn on a figure, `_in_short` where there is much of a kind."""
    plain = to_plain(figure)
    for axes in plain["axes"]:
        kinds: dict[str, list[Any]] = {}
        for artist in axes["artists"]:
            kinds.setdefault(next(iter(artist)), []).append(artist)
        axes["artists"] = {
            kind: some if len(some) <= SEVERAL else {"count": len(some), **_in_short(some)}
            for kind, some in kinds.items()
        }
    return plain


def _in_short(value: object) -> dict[str, Any]:
    """How often each word stands in a value, and sums of its numbers."""
    words, numbers = Counter[str](), list[float]()
    _take_apart(value, words, numbers)
    # Few numbers are summed up as well, which are kept as they are otherwise.
    some = [*numbers, *[0.0] * (FEW + 1)] if len(numbers) <= FEW else numbers
    digest = to_plain(np.array(some))
    sums = {key: digest[key] for key in ("of size", "sums")}
    return {"words": dict(sorted(words.items())), "numbers": len(numbers), **sums}


def _take_apart(value: object, words: Counter[str], numbers: list[float]) -> None:
    match value:
        case str() if value.startswith("/"):
            # A path of Meshcat.
            pass
        case str():
            words[value] += 1
        case int() | float():
            numbers.append(float(value))
        case np.ndarray():
            numbers.extend(np.asarray(value, dtype=float).ravel().tolist())
        case dict():
            _take_apart(list(value.values()), words, numbers)
        case list() | tuple():
            for each in value:
                _take_apart(each, words, numbers)
        case _:
            words[str(value)] += 1


def left_in(folder: Path) -> dict[str, Any]:
    """What the files in a folder say, by their paths; of replays only that there is one."""
    files = sorted(each for each in folder.rglob("*") if each.is_file())
    shown = [each for each in files if not each.name.startswith(".")]
    return {str(each.relative_to(folder)): _content(each, folder.parent) for each in shown}


def _content(file: Path, home: Path) -> Any:
    match file.suffix:
        case ".json" | ".geojson":
            text = file.read_text(encoding="utf-8").replace(str(home), "...")
            return _sure(json.loads(text))
        case ".npz":
            with np.load(file) as arrays:
                return {name: arrays[name] for name in sorted(arrays.files)}
        case ".parquet":
            return _sure(pq.read_table(file).to_pydict())
        case ".csv":
            head, *rows = file.read_text(encoding="utf-8").splitlines()
            return [head, np.array([[float(each) for each in row.split(",")] for row in rows])]
        case ".md" | ".txt" | ".yaml" | ".wkt":
            return file.read_text(encoding="utf-8").splitlines()
        case ".png":
            with Image.open(file) as picture:
                return picture.size
    return None


def _sure(value: Any) -> Any:
    """What is the same on every machine."""
    if isinstance(value, dict):
        value = {key: each for key, each in value.items() if not UNSURE.search(key)}
        if "coordinates" in value and isinstance(value["coordinates"], list):
            value["coordinates"] = _in_short(value["coordinates"])
        return {key: _sure(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_sure(each) for each in value]
    return value


def _said(text: str, folder: Path) -> list[str] | Any:
    """Lines on standard output, or its JSON, without what hangs on the machine."""
    if text.startswith("{"):
        return _sure(json.loads(text))
    # How a table is framed is not what it says.
    text = re.sub("[\u2500-\u257f]+", "|", text)
    lines = [each.rstrip().replace(str(folder), "...") for each in text.splitlines()]
    return [each for each in lines if not UNSURE.search(each.strip()) and "http:" not in each]

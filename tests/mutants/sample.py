"""How many of the faults that anyone might make do the tests find? Drawn at random, over all rooms.

Each fault of the sample is made in a copy of the tree, and the tests of the folder that mirrors its
file are run: first those named for the file or importing it, then the others. A fault is found when
a test fails that passes without it, when one never ends, and when one ends with a crash. What was
tried is written to a file line by line; with the same file the sample is gone on with.
"""

import json
import re
import runpy
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

sys.path.insert(0, str(Path(__file__).parent))
from faults import Fault, faults_of
from run import NEVER_ENDED, PASSED, ROOT, copy_tree, run_tests

# Tests that take longer than this with a fault are timed without it [s].
LONGEST_RUN = 300.0
# How many times as long as without a fault tests may take before they count as never ending.
_TIMES_AS_LONG = 3.0

# pytest's exit code where all tests were deselected.
_NO_TESTS = 5

# Modules of the public surface, which load what is asked for.
_STORIES = {file.stem for file in (ROOT / "surface").glob("*.py")}

_IMPORTS_OF = runpy.run_path(str(ROOT / "tests" / "test_architecture.py"))["imports_of"]


@dataclass(frozen=True)
class Module:
    """A file of the package, by its path from the root, the story it belongs to, and its faults."""

    file: Path
    story: str
    faults: tuple[Fault, ...]


def read_modules() -> list[Module]:
    """All files that hold code, in the order of their names."""
    files = [file for part in ("systems", "diagrams", "hardware_io") for file in _sources(part)]
    read = [
        Module(file, _story(file), tuple(faults_of(_text(ROOT / file)))) for file in sorted(files)
    ]
    return [each for each in read if each.faults]


def draw(modules: list[Module], number: int, seed: int) -> list[tuple[Module, Fault]]:
    """Faults drawn without replacement, each as likely as any other of the whole package."""
    every = [(module, fault) for module in modules for fault in module.faults]
    drawn = np.random.default_rng(seed).permutation(len(every))[:number]
    return [every[int(each)] for each in drawn]


def tests_of(file: Path) -> tuple[list[str], list[str]]:
    """The test files for a file: those that are named for it or import it, and the others.

    They lie in the folder that mirrors the file's story, on its floor; those of commands, which
    have no folder of their own, beside the stories' folders. Links to hardware are one story. The
    others import it over other modules, over fewer first, or import the package by its stories or
    its commands, which load what they need.
    """
    floor, *rooms = file.parts[1:] if file.parts[:2] == ("systems", "numerics") else file.parts
    folder = ROOT / "tests" / floor
    mirror = folder if floor == "hardware_io" else folder / Path(rooms[0]).stem
    found = sorted(mirror.rglob("test_*.py") if mirror.is_dir() else folder.glob("test_*.py"))
    away = {_dotted(each): steps for each, steps in _steps_away(file).items()}
    first, others = list[str](), list[tuple[int, str]]()
    for test in found:
        name = str(test.relative_to(ROOT))
        # The fixtures of `tests` itself run commands, which other floors have not.
        top = ROOT / "tests" if floor == "diagrams" else folder
        above = [each / "conftest.py" for each in test.parents if each.is_relative_to(top)]
        used = _imported(test).union(*(_imported(each) for each in above if each.is_file()))
        steps = min((away.get(each, len(away)) for each in used), default=len(away))
        if file.stem in test.stem or _dotted(file) in _imported(test):
            first.append(name)
        elif steps < len(away) or any(map(_loads_more, used)):
            others.append((steps, name))
    return first, [name for _, name in sorted(others)]


def try_fault(module: Module, fault: Fault) -> dict[str, object]:
    """Make a fault in a copy of the tree, and see which test finds it."""
    about: dict[str, object] = {"file": str(module.file), "story": module.story, "line": fault.line}
    source = _text(ROOT / module.file)
    about |= {"old": source[fault.start : fault.end], "new": fault.new, "found": None}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_tree(folder, stale=_steps_away(module.file))
        file = folder / module.file
        file.write_text(fault.made_in(source), encoding="utf-8")
        spoilt: list[str] = []
        for tests in filter(None, tests_of(module.file)):
            while True:
                deselected = [word for test in spoilt for word in ("--deselect", test)]
                code, said = _run_to_the_end(folder, tests, deselected)
                if code == NEVER_ENDED:
                    return about | {"found": said}
                if code in (PASSED, _NO_TESTS):
                    break
                if code < 0:
                    # Compiled code that reads beyond an array ends the process.
                    return about | {"found": f"pytest was ended by signal {-code}"}
                failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", said, re.MULTILINE)
                if failed is None or failed[1] in spoilt:
                    raise RuntimeError(f"pytest ended with {code}:\n{said}")
                test = failed[1]
                # Its parameters may be named after what the fault changes.
                if _passes_without(test.partition("[")[0]):
                    return about | {"found": test}
                print(f"fails without the fault too: {test}", flush=True)
                spoilt.append(test)
    return about


def _run_to_the_end(folder: Path, tests: list[str], deselected: list[str]) -> tuple[int, str]:
    """Run tests; they never end only if without a fault they do in a third of the time."""
    code, said = run_tests(folder, [*tests, *deselected], LONGEST_RUN)
    if code == NEVER_ENDED:
        longest = _TIMES_AS_LONG * _time_without(tuple(tests))
        if longest > LONGEST_RUN:
            return run_tests(folder, [*tests, *deselected], longest)
    return code, said


@cache
def _time_without(tests: tuple[str, ...]) -> float:
    """How long tests take without a fault [s]."""
    with tempfile.TemporaryDirectory() as name:
        copy_tree(Path(name), stale=set())
        begun = time.monotonic()
        run_tests(Path(name), tests)
        return time.monotonic() - begun


@cache
def _passes_without(test: str) -> bool:
    with tempfile.TemporaryDirectory() as name:
        copy_tree(Path(name), stale=set())
        return run_tests(Path(name), [test], LONGEST_RUN)[0] == PASSED


def _sources(part: str) -> list[Path]:
    return [
        file.relative_to(ROOT)
        for file in (ROOT / part).rglob("*.py")
        if "__pycache__" not in file.parts
    ]


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def _story(file: Path) -> str:
    parts = [part for part in file.parts[:-1] if part not in {"systems", "numerics", "diagrams"}]
    return parts[0] if parts else "shared"


def _dotted(file: Path) -> str:
    """Name by which a file is imported; that of `__init__.py` is its folder's."""
    return ".".join(file.with_suffix("").parts).removesuffix(".__init__")


@cache
def _imported(file: Path) -> set[str]:
    """Modules that a file imports, as `systems.numerics.errors`, and those it takes a name from."""
    names = set(_IMPORTS_OF(_text(file), file.relative_to(ROOT)))
    return names | {name.rpartition(".")[0] for name in names}


@cache
def _importers() -> dict[str, set[Path]]:
    """The files that import each module."""
    importers: dict[str, set[Path]] = {}
    for part in ("systems", "diagrams", "hardware_io"):
        for each in _sources(part):
            for name in _imported(ROOT / each):
                importers.setdefault(name, set()).add(each)
    return importers


def _steps_away(file: Path) -> dict[Path, int]:
    """The file and all that import it, whose compiled code is stale, and over how many others."""
    away, new, steps = dict[Path, int](), {file}, 0
    while new:
        away |= dict.fromkeys(new, steps)
        every = {each for old in new for each in _importers().get(_dotted(old), ())}
        new, steps = every - away.keys(), steps + 1
    return away


def _loads_more(name: str) -> bool:
    """Whether a module that a test imports loads others when they are asked for."""
    return name.partition(".")[0] in _STORIES or name.startswith("diagrams.commands")


def main(
    number: Annotated[int, typer.Option(min=1, help="Faults in the sample.")] = 500,
    seed: Annotated[int, typer.Option(help="Of the draw.")] = 1,
    out: Annotated[Path, typer.Option(help="What was tried, a line each.")] = Path(
        "build/mutants.jsonl"
    ),
    most: Annotated[int | None, typer.Option(help="Try that many of them now.")] = None,
) -> None:
    """Draw faults at random and print the share that the tests find, for each story."""
    sample = draw(read_modules(), number, seed)
    out.parent.mkdir(parents=True, exist_ok=True)
    tried = [json.loads(line) for line in _text(out).splitlines()] if out.exists() else []
    with out.open("a", encoding="utf-8") as written:
        for module, fault in sample[len(tried) :][:most]:
            done = try_fault(module, fault)
            written.write(json.dumps(done) + "\n")
            written.flush()
            tried.append(done)
            fate = "found" if done["found"] else "SURVIVES"
            print(f"{len(tried):3}/{len(sample)} {fate}: {done['file']}:{done['line']}", flush=True)
    every = Counter(each["story"] for each in tried)
    found = Counter(each["story"] for each in tried if each["found"])
    for story in sorted(every):
        print(f"{story:12} {found[story]:4} of {every[story]:4}  {found[story] / every[story]:.0%}")
    print(f"{'all':12} {found.total():4} of {every.total():4}")


if __name__ == "__main__":
    typer.run(main)

"""How many of the faults that anyone might make do the tests find? Drawn at random, over all rooms.

Each fault of the sample is made in a copy of the tree, and the tests that reach its line are run,
those of its own room first. A fault is found when a test fails that passes without it, when one
never ends, and when one ends with a crash. What was tried is written to a file line by line, where
survivors wait for a test; with the same file the sample is gone on with, even if code elsewhere has
changed meanwhile. A survivor whose line is taken out of the file is tried again.
"""

import hashlib
import json
import re
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import typer

sys.path.insert(0, str(Path(__file__).parent))
from faults import Fault, faults_of
from reach import Reach, record
from run import FAILED, NEVER_ENDED, PASSED, ROOT, copy_tree, run_tests

# How long the tests of one fault may take, as they were recorded: others are left out [s].
LONGEST_TESTS = 60.0
# With what has to be compiled, and a machine that does other things, too. Then they never end [s].
LONGEST_RUN = 300.0

# pytest's exit code where all tests were deselected.
_NO_TESTS = 5


@dataclass(frozen=True)
class Module:
    """A file of the package, by its path from the root, the story it belongs to, and its faults.

    Each fault has a name: what is changed in which line, and which one of several alike it is.
    """

    file: Path
    story: str
    faults: dict[str, Fault]


def read_modules() -> list[Module]:
    """All files that hold code, in the order of their names."""
    files = [file for part in ("systems", "diagrams", "hardware_io") for file in _sources(part)]
    read = [Module(file, _story(file), dict(_faults_in(file))) for file in sorted(files)]
    return [each for each in read if each.faults]


def _faults_in(file: Path) -> Iterator[tuple[str, Fault]]:
    """The faults of a file but those that change nothing, and their names."""
    source = _text(ROOT / file)
    lines = source.splitlines()
    same = equivalents().get(str(file), ())
    alike = Counter[tuple[str, str, str]]()
    for fault in faults_of(source):
        told = (lines[fault.line - 1].strip(), source[fault.start : fault.end], fault.new)
        alike[told] += 1
        if told not in same and (*told, alike[told]) not in same:
            yield f"{file}: {told[0]}: {told[1]} -> {told[2]} ({alike[told]})", fault


@cache
def equivalents() -> dict[str, set[tuple[str | int, ...]]]:
    """Faults that change nothing that could be seen, by file: the line, what stands there, what
    stands there instead, and which one of several alike if not all. Why is said in
    `equivalents.toml`."""
    found = dict[str, set[tuple[str | int, ...]]]()
    for each in tomllib.loads(_text(Path(__file__).with_name("equivalents.toml")))["equivalent"]:
        for file, *fault in each["faults"]:
            found.setdefault(file, set()).add(tuple(fault))
    return found


def draw(modules: list[Module], number: int, seed: int) -> list[tuple[str, Module]]:
    """Names of faults drawn without replacement, each as likely as any other of the whole package.

    A fault's place in the draw comes from its name: where code changes, the sample changes there.
    """

    def place(drawn: tuple[str, Module]) -> bytes:
        return hashlib.sha256(f"{seed} {drawn[0]}".encode()).digest()

    every = [(name, module) for module in modules for name in module.faults]
    return sorted(every, key=place)[:number]


def try_fault(name: str, module: Module, reach: Reach) -> dict[str, object]:
    """Make a fault in a copy of the tree, and see which test finds it."""
    fault = module.faults[name]
    about: dict[str, object] = {"name": name, "story": module.story, "found": None}
    source = _text(ROOT / module.file)
    tests = reach.chosen(module.file, fault.line, LONGEST_TESTS)
    if not tests:
        return about
    with tempfile.TemporaryDirectory() as copy:
        folder = Path(copy)
        copy_tree(folder, stale={module.file, *reach.compiled_with(module.file, fault.line)})
        file = folder / module.file
        file.write_text(fault.made_in(source), encoding="utf-8")
        spoilt: list[str] = []
        while True:
            deselected = [word for test in spoilt for word in ("--deselect", test)]
            code, said = run_tests(folder, [*tests, *deselected], LONGEST_RUN)
            if code == NEVER_ENDED:
                return about | {"found": said}
            if code in (PASSED, _NO_TESTS):
                return about
            if code < 0:
                # Compiled code that reads beyond an array ends the process.
                return about | {"found": f"pytest was ended by signal {-code}"}
            failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", said, re.MULTILINE)
            if failed is None and code != FAILED:
                # The package, or what tests share, cannot be imported.
                return about | {"found": "no test runs"}
            if failed is None or failed[1] in spoilt:
                raise RuntimeError(f"pytest ended with {code}:\n{said}")
            test = failed[1]
            # Its parameters may be named after what the fault changes.
            if _passes_without(test.partition("[")[0]):
                return about | {"found": test}
            print(f"fails without the fault too: {test}", flush=True)
            spoilt.append(test)


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


def main(
    number: Annotated[int, typer.Option(min=1, help="Faults in the sample.")] = 500,
    seed: Annotated[int, typer.Option(help="Of the draw.")] = 11,
    out: Annotated[Path, typer.Option(help="What was tried, a line each.")] = Path(
        "tests/mutants/tried.jsonl"
    ),
    reached: Annotated[Path, typer.Option(help="Which tests reach what.")] = Path("build/reach"),
    new: Annotated[
        list[Path] | None, typer.Option(help="Tests that came after what is recorded.")
    ] = None,
    most: Annotated[int | None, typer.Option(help="Try that many of them now.")] = None,
    room: Annotated[str, typer.Option(help="Draw from files whose path begins so.")] = "",
    workers: Annotated[int, typer.Option(min=1, help="Faults tried side by side.")] = 2,
) -> None:
    """Draw faults at random and print the share that the tests find, for each story."""
    if new or not reached.exists():
        record(reached, workers, [str(each) for each in new or ()])
    reach = Reach(reached)
    modules = [each for each in read_modules() if str(each.file).startswith(room)]
    sample = dict(draw(modules, number, seed))
    out.parent.mkdir(parents=True, exist_ok=True)
    read = [json.loads(line) for line in _text(out).splitlines()] if out.exists() else []
    tried = {each["name"]: each for each in read if each["name"] in sample}
    left = [each for each in sample.items() if each[0] not in tried][:most]
    with out.open("a", encoding="utf-8") as written, ThreadPoolExecutor(workers) as pool:
        trying = [pool.submit(try_fault, *drawn, reach) for drawn in left]
        for ended in as_completed(trying):
            if ended.exception() is not None:
                pool.shutdown(cancel_futures=True)
            about = ended.result()
            written.write(json.dumps(about) + "\n")
            written.flush()
            tried[str(about["name"])] = about
            fate = "found" if about["found"] else "SURVIVES"
            print(f"{len(tried):3}/{len(sample)} {fate}: {about['name']}", flush=True)
    every = Counter(each["story"] for each in tried.values())
    found = Counter(each["story"] for each in tried.values() if each["found"])
    for story in sorted(every):
        print(f"{story:12} {found[story]:4} of {every[story]:4}  {found[story] / every[story]:.0%}")
    print(f"{'all':12} {found.total():4} of {every.total():4}")


if __name__ == "__main__":
    typer.run(main)

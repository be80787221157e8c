"""Try the mutants of `mutants.toml`: each fault, made in a copy of the tree, is to fail its test.

Given words, only mutants with one of them in their name or file are tried. Ends with 1 when one
survives, or when its test cannot tell. The checkout itself is never changed.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# A fault may send a test round in circles, and is not found by it then [s].
LONGEST_RUN = 900.0

# pytest's exit codes, and what stands for none.
PASSED, FAILED, NEVER_ENDED = 0, 1, -1


@dataclass(frozen=True, kw_only=True)
class Mutant:
    """A fault, and the test that finds it; the keys of `mutants.toml`."""

    name: str
    file: str
    old: str
    new: str
    test: str

    def applied(self, source: str) -> str:
        """The source with the fault in it."""
        return source.replace(self.old, self.new)


def read_mutants() -> list[Mutant]:
    """All mutants, in the order of the list."""
    listed = tomllib.loads(Path(__file__).with_name("mutants.toml").read_text(encoding="utf-8"))
    return [Mutant(**each) for each in listed["mutant"]]


def copy_tree(folder: Path, stale: Collection[Path] | None = None) -> None:
    """Copy the package and its tests, without what is stale of what Python and Numba have compiled.

    Numba looks whether a function's own file has changed, and not those of the functions that it
    calls: only without its cache is each fault surely compiled.

    Args:
        folder: Where to.
        stale: Files whose compiled code is left out, from the root; None: all.
    """
    described = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    parts: dict[str, str] = described["tool"]["setuptools"]["package-dir"]
    shutil.copy(ROOT / "pyproject.toml", folder)
    old = {(file.parent, file.stem) for file in stale or ()}

    def left_out(name: str, inside: list[str]) -> set[str]:
        if stale is None:
            return {"__pycache__"} & set(inside)
        # The caches of `name.py` begin with its name and a point.
        room = Path(name).relative_to(ROOT).parent
        return {each for each in inside if (room, each.partition(".")[0]) in old and ".py" in each}

    for part in (*parts.values(), "tests"):
        shutil.copytree(ROOT / part, folder / part, ignore=left_out)
    for name, part in parts.items():
        link = folder / "installed" / name.replace(".", "/")
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(folder / part, target_is_directory=True)


def test_environment(path: Path) -> dict[str, str]:
    """What a run of tests finds in its environment, with a folder where modules are looked for.

    What an outer pytest says to its own processes is not meant for it. With CI=true a test whose
    tools are missing fails, and is not skipped.
    """
    outer = {name: each for name, each in os.environ.items() if not name.startswith("PYTEST_")}
    return {**outer, "PYTHONPATH": str(path), "CI": "true"}


def run_tests(
    folder: Path, tests: Collection[str], longest: float = LONGEST_RUN
) -> tuple[int, str]:
    """Run tests on a copy of the tree, for so long at most [s].

    Returns:
        pytest's exit code, or NEVER_ENDED, and what it printed.
    """
    # Looked at before site-packages, in which an editable install leads to the checkout.
    environment = test_environment(folder / "installed")
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    captured = {"cwd": folder, "env": environment, "capture_output": True, "text": True}
    try:
        done = subprocess.run(command, **captured, timeout=longest)
    except subprocess.TimeoutExpired:
        return NEVER_ENDED, f"no end after {longest:.0f} s"
    return done.returncode, done.stdout + done.stderr


def try_mutant(mutant: Mutant) -> tuple[int, str]:
    """Run a mutant's test on a copy of the tree that has the fault; see `run_tests`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copy_tree(folder)
        file = folder / mutant.file
        file.write_text(mutant.applied(file.read_text(encoding="utf-8")), encoding="utf-8")
        return run_tests(folder, [mutant.test])


def main(words: list[str]) -> int:
    """Try the mutants; 0 when the tests find them all."""
    chosen = [
        mutant
        for mutant in read_mutants()
        if not words or any(word in mutant.name or word in mutant.file for word in words)
    ]
    if not chosen:
        print(f"no mutant has one of {words} in its name or file")
        return 1
    print("without a fault ...", flush=True)
    with tempfile.TemporaryDirectory() as name:
        copy_tree(Path(name))
        code, said = run_tests(Path(name), dict.fromkeys(mutant.test for mutant in chosen))
    if code != PASSED:
        print(said)
        return 1
    alive = 0
    for number, mutant in enumerate(chosen, start=1):
        begun = time.monotonic()
        code, said = try_mutant(mutant)
        took = time.monotonic() - begun
        fate = {FAILED: "dies", PASSED: "SURVIVES"}.get(code, f"pytest ended with {code}\n{said}")
        alive += code != FAILED
        print(f"{number:3}/{len(chosen)} {took:4.0f} s  {fate}: {mutant.name}", flush=True)
    print(f"{alive} of {len(chosen)} survive")
    return 1 if alive else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

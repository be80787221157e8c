"""Which tests reach a line of the package, and how long they take: recorded in one run of them all.

Python's lines are recorded by coverage.py, with the test as context. Compiled code runs no lines of
Python: there it is recorded which compiled functions a test calls, and which of them call others.
What runs when a module is imported is reached by the tests that run a line with one of its names.

As a plugin of pytest (`-p reach`) it records; `Reach` looks up what was recorded.
"""

import ast
import json
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from functools import cache, cached_property
from itertools import takewhile
from pathlib import Path
from types import CodeType
from typing import Any, TypeVar

import coverage
import pytest
from run import ROOT, test_environment

# Where processes of tests write what they record.
_FOLDER = "SIGHTFIELD_REACH"
_PARTS = ("surface", "systems", "diagrams", "hardware_io")
# Other tests are of pages, notebooks and the wheel, for which a copy of the package is not enough.
_TESTS = ("tests/numerics", "tests/systems", "tests/diagrams", "tests/hardware_io")

# Files of tests that are run whole, however few of them reach a line [s].
_SHORT = 10.0
# All tests of a story that are taken where none of them is known to reach a line [s].
_WHOLE_STORY = 120.0

# Where a compiled function stands: its file and its first line.
_Kernel = tuple[str, int]
_Node = TypeVar("_Node", bound=ast.stmt)


class _Recorder:
    """Records in one process of tests."""

    def __init__(self, folder: Path) -> None:
        name = os.environ["PYTEST_XDIST_WORKER"]
        before = len(list(folder.glob("*.json")))
        self._file = folder / f"{before:03}.{name}.json"
        self._lines = coverage.Coverage(
            data_file=folder / f"lines.{name}",
            config_file=False,
            source=[str(ROOT / part) for part in _PARTS],
        )
        self._lines.set_option("run:relative_files", True)
        self._tests: dict[str, dict[str, object]] = {}
        self._called: set[object] = set()
        self._known: dict[object, dict[str, object]] = {}
        self._lines.start()
        self._listen_to_kernels()

    def _listen_to_kernels(self) -> None:
        from numba.core.registry import CPUDispatcher

        call: Callable[..., object] = CPUDispatcher.__call__
        called = self._called

        def noted(dispatcher: object, *args: object, **options: object) -> object:
            called.add(dispatcher)
            return call(dispatcher, *args, **options)

        CPUDispatcher.__call__ = noted

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._called.clear()
        self._lines.switch_context(item.nodeid)
        try:
            return (yield)
        finally:
            self._lines.switch_context("")
            about = self._tests.setdefault(item.nodeid, {})
            about["kernels"] = [self._kernel(each) for each in list(self._called)]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        about = self._tests.setdefault(report.nodeid, {"passed": True})
        about[report.when] = report.duration
        about["passed"] = about.get("passed", True) and report.passed

    def pytest_sessionfinish(self) -> None:
        self._lines.stop()
        self._lines.save()
        kernels = list(self._known.values())
        self._file.write_text(json.dumps({"tests": self._tests, "kernels": kernels}))

    def _kernel(self, dispatcher: Any) -> _Kernel:
        """Where a compiled function stands; what it calls and names is noted once."""
        function = dispatcher.py_func
        code = function.__code__
        place = (os.path.relpath(code.co_filename, ROOT), code.co_firstlineno)
        if dispatcher not in self._known:
            names = sorted(_names(code))
            known: dict[str, object] = {"place": place, "names": names, "calls": []}
            self._known[dispatcher] = known
            cells = [cell.cell_contents for cell in function.__closure__ or ()]
            used = [function.__globals__.get(name) for name in names]
            found = [each for each in (*used, *cells) if hasattr(each, "py_func")]
            known["calls"] = [self._kernel(each) for each in found]
        return place


def _names(code: CodeType) -> set[str]:
    """Global names that a function and those inside it use."""
    inner = [each for each in code.co_consts if isinstance(each, CodeType)]
    return set(code.co_names).union(*map(_names, inner))


def record(folder: Path, workers: int, tests: Iterable[str] = ()) -> None:
    """Run tests and record what they reach.

    Args:
        folder: Where to; what is recorded there already is kept beside it.
        workers: Processes side by side.
        tests: Files or folders of them; none: all of the package.
    """
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**test_environment(Path(__file__).parent), _FOLDER: str(folder)}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "reach", "-n", str(workers)]
    command += ["--dist", "worksteal", *(tests or _TESTS)]
    subprocess.run(command, cwd=ROOT, env=environment, check=False)
    data = coverage.CoverageData(basename=str(folder / "lines"))
    data.read()
    for part in sorted(folder.glob("lines.*")):
        read = coverage.CoverageData(basename=str(part))
        read.read()
        data.update(read)
        part.unlink()
    data.write()


def pytest_configure(config: pytest.Config) -> None:
    """Record in processes that run tests; the one that hands them out has none."""
    if _RECORDER is not None:
        config.pluginmanager.register(_RECORDER)


# Before anything of the package is imported, so that what runs at import is seen as such.
_RECORDER = None
if _FOLDER in os.environ and "PYTEST_XDIST_WORKER" in os.environ:
    _RECORDER = _Recorder(Path(os.environ[_FOLDER]))


class Reach:
    """What was recorded.

    Args:
        folder: Where `record` put it.
    """

    def __init__(self, folder: Path) -> None:
        self._data = coverage.CoverageData(basename=str(folder / "lines"))
        self._data.read()
        self._tests: dict[str, dict[str, Any]] = {}
        self._kernels: dict[_Kernel, tuple[set[str], set[_Kernel]]] = {}
        for file in sorted(folder.glob("*.json")):
            read = json.loads(file.read_text())
            self._tests |= read["tests"]
            for each in read["kernels"]:
                names, calls = self._kernels.setdefault(tuple(each["place"]), (set(), set()))
                names.update(each["names"])
                calls.update(map(tuple, each["calls"]))

    def chosen(self, file: Path, line: int, longest: float) -> list[str]:
        """Tests to try on a fault in a line: those nearest to its file first, then the quickest.

        What tests of a file share, as a run of a game, is reached by the first of them alone: so
        all tests of a file are taken, if they are not much longer than those that reach the line.
        What runs when a module is imported, and gives no name, is reached by whoever comes first.
        What runs in processes of their own is not recorded: where no test of a file's story reaches
        a line, all of its story's are taken as well, if they are not too long.

        Args:
            file: From the root.
            line: From 1.
            longest: What they may take together [s].
        """
        parts = [each for each in file.parts if each != "systems" or "numerics" not in file.parts]
        tree = _tree(ROOT / file)
        nameless = _around(tree, line, ast.FunctionDef) is None and not _given(tree, line)
        short = longest if nameless else _SHORT
        reaching = defaultdict(list)
        for test in sorted(self.tests(file, line)):
            # Of a recording that was broken off, lines are known and not how a test ended.
            if self._tests.get(test, {}).get("passed") and test.startswith(_TESTS):
                reaching[test.partition("::")[0]].append(test)
        ranked = []
        for name, some in reaching.items():
            seconds, whole = self._seconds(some), self._seconds(self._by_file[name])
            every = all(self._tests[test].get("passed") for test in self._by_file[name])
            taken = [name] if every and whole < max(3 * seconds, short) else some
            both = zip(parts, Path(name).parts[1:], strict=False)
            together = list(takewhile(lambda pair: pair[0] == pair[1], both))
            ranked.append((-len(together), seconds if taken is some else whole, taken))
        found, total = list[str](), 0.0
        for _, seconds, taken in sorted(ranked):
            total += seconds
            if total > longest and found:
                break
            found += taken
        story = Path("tests", *parts[:2])
        if (ROOT / story).is_dir() and not any(test.startswith(str(story)) for test in found):
            every = [test for test in self._tests if test.startswith(f"{story}/")]
            # How long they take is not known if none is recorded.
            if every and self._seconds(every) <= _WHOLE_STORY:
                found.append(str(story))
        return found

    def compiled_with(self, file: Path, line: int) -> set[Path]:
        """Files with compiled functions that hold what stands in a line, whatever calls it."""
        around = _around(_tree(ROOT / file), line, ast.FunctionDef)
        kernels = self._kernels_at(file, line) if around else self._kernels_with(file, line)
        return {Path(at) for at, _ in self._callers(kernels)}

    def tests(self, file: Path, line: int) -> set[str]:
        """Tests that reach a line of a file, given from the root."""
        tree = _tree(ROOT / file)
        function = _around(tree, line, ast.FunctionDef)
        if function is None:
            return self._of_names(file, tree, line)
        kernels = self._kernels_at(file, line)
        if kernels:
            return self._of_kernels(kernels)
        statement = _around(tree, line, ast.stmt)
        if statement is None or statement is function:
            return self._in(file, function)
        # Python tells the first lines of what goes over several.
        return self._ran(file, {line}) or self._ran(file, range(statement.lineno, line + 1))

    def _kernels_at(self, file: Path, line: int) -> set[_Kernel]:
        """The compiled function around a line, if there is one."""
        function = _around(_tree(ROOT / file), line, ast.FunctionDef)
        if function is None:
            return set()
        first = min([function.lineno, *(each.lineno for each in function.decorator_list)])
        return {(str(file), first)} & self._kernels.keys()

    def _kernels_with(self, file: Path, line: int) -> set[_Kernel]:
        """Compiled functions that use a name which a line gives."""
        names = _given(_tree(ROOT / file), line)
        return {at for at, (used, _) in self._kernels.items() if used & names}

    def _seconds(self, tests: Iterable[str]) -> float:
        """How long tests take together [s]."""
        every = [self._tests[test] for test in tests]
        return sum(float(each.get(phase, 0)) for each in every for phase in ("setup", "call"))

    @cached_property
    def _by_file(self) -> dict[str, list[str]]:
        files = defaultdict(list)
        for test in self._tests:
            files[test.partition("::")[0]].append(test)
        return files

    def _ran(self, file: Path, lines: Iterable[int]) -> set[str]:
        by_line = self._contexts(file)
        return {test for line in lines for test in by_line.get(line, ()) if test}

    def _in(self, file: Path, node: ast.stmt) -> set[str]:
        return self._ran(file, range(node.lineno, (node.end_lineno or node.lineno) + 1))

    def _contexts(self, file: Path) -> dict[int, list[str]]:
        return self._data.contexts_by_lineno(str(file))

    def _callers(self, kernels: set[_Kernel]) -> set[_Kernel]:
        """Compiled functions, and all that call them."""
        new = reached = set(kernels)
        while new:
            new = {at for at, (_, calls) in self._kernels.items() if calls & new} - reached
            reached = reached | new
        return reached

    def _of_kernels(self, kernels: set[_Kernel]) -> set[str]:
        reached = self._callers(kernels)
        return {
            name
            for name, about in self._tests.items()
            if any(tuple(each) in reached for each in about.get("kernels", ()))
        }

    def _of_names(self, file: Path, tree: ast.Module, line: int) -> set[str]:
        """Tests that run a line of the package with a name that a line gives."""
        names = _given(tree, line)
        found = self._of_kernels(self._kernels_with(file, line))
        for other in _naming(names):
            inside = [
                each.lineno
                for each in ast.walk(_tree(ROOT / other))
                if (isinstance(each, ast.Name) and each.id in names)
                or (isinstance(each, ast.Attribute) and each.attr in names)
                or (isinstance(each, ast.keyword) and each.arg in names)
            ]
            found |= self._ran(other, inside)
        whole = range(1, len(_texts()[file].splitlines()) + 1)
        return found or self._ran(file, whole)


def _given(tree: ast.Module, line: int) -> set[str]:
    """Names that the statement around a line gives."""
    statement = _around(tree, line, ast.stmt)
    every = ast.walk(statement) if statement else ()
    names = (each for each in every if isinstance(each, ast.Name))
    return {each.id for each in names if isinstance(each.ctx, ast.Store)}


def _naming(names: set[str]) -> list[Path]:
    """Files of the package in which one of some names stands."""
    return [file for file, text in _texts().items() if any(name in text for name in names)]


@cache
def _texts() -> dict[Path, str]:
    files = [file for part in _PARTS for file in (ROOT / part).rglob("*.py")]
    return {each.relative_to(ROOT): each.read_text(encoding="utf-8") for each in files}


@cache
def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


def _around(tree: ast.AST, line: int, kind: type[_Node]) -> _Node | None:
    """The innermost statement of a kind around a line."""
    found: _Node | None = None
    for node in ast.walk(tree):
        if isinstance(node, kind) and node.lineno <= line <= (node.end_lineno or 0):
            found = node
    return found

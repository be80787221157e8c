"""The house rules that a program can check, read from the sources."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Imports run from a higher floor to a lower one, or stay on it.
FLOORS = {"systems.numerics": 0, "systems": 1, "diagrams": 2, "hardware_io": 3, "surface": 4}

# The modules that swap simulation for the real thing, one for robots and one for the social
# network: they alone look up to it.
STATIONS = {Path("diagrams/station/hardware.py"), Path("diagrams/social/networks.py")}


def project_files() -> list[Path]:
    """Files of the project, committed or about to be, relative to its root."""
    # CI may run as another user than the owner of the checkout.
    git = ["git", "-c", "safe.directory=*", "ls-files", "-z", "-co", "--exclude-standard"]
    listed = subprocess.run(git, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = sorted({Path(name) for name in listed.split("\0") if name})
    return [file for file in files if (ROOT / file).is_file()]


FILES = project_files()
SOURCES = [file for file in FILES if file.suffix == ".py"]
PARTS = {floor.partition(".")[0] for floor in FLOORS}
MODULES = [file for file in SOURCES if file.parts[0] in PARTS]
NUMERICS = [file for file in MODULES if file.parts[:2] == ("systems", "numerics")]


def read(file: Path) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


def dotted(file: Path) -> str:
    """Name of a module below `sightfield.`."""
    parts = file.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def floor_of(name: str) -> int | None:
    """Floor of a module, by its name below `sightfield.`; None if it is not ours."""
    fitting = [floor for floor in FLOORS if name == floor or name.startswith(floor + ".")]
    return FLOORS[max(fitting, key=len)] if fitting else None


def imports_of(source: str, file: Path) -> list[str]:
    """Modules that a source file imports, anywhere in it; ours named below `sightfield.`."""
    package = list(file.parent.parts)
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = [*base, *(node.module or "").split(".")] if node.module else base
            # `from . import name` may name a module or something in one: both are looked at.
            found += [".".join([*stem, alias.name]) for alias in node.names]
    return [name.removeprefix("sightfield.") for name in found]


def upward_imports(source: str, file: Path) -> list[str]:
    """Imports of a module that lead to a higher floor than its own."""
    own = FLOORS["hardware_io"] if file in STATIONS else floor_of(dotted(file))
    assert own is not None
    return [name for name in imports_of(source, file) if (floor_of(name) or 0) > own]


def reports(files: list[Path], faults) -> list[str]:
    """'file: fault' for every fault that a function of source and file finds."""
    return [f"{file}: {fault}" for file in files for fault in faults(read(file), file)]


def test_there_is_something_to_check():
    assert {file.parts[0] for file in MODULES} >= {"systems", "diagrams"}
    assert len(NUMERICS) > 1


def test_imports_run_downwards():
    assert reports(MODULES, upward_imports) == []


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("systems/numerics/a.py", "from ..tracking import b"),
        ("systems/numerics/geometry/a.py", "from ... import tracking"),
        ("systems/tracking/a.py", "from sightfield.diagrams.visuals import b"),
        ("systems/tracking/a.py", "def f():\n    from ...diagrams import b"),
        ("diagrams/a.py", "import sightfield.hardware_io"),
        ("diagrams/station/run.py", "from ...hardware_io.mocap import pose_source"),
    ],
)
def test_an_import_upwards_is_seen(file, line):
    assert len(upward_imports(line, Path(file))) == 1


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("diagrams/tracking/a.py", "from ...systems.numerics.errors import require"),
        ("diagrams/tracking/a.py", "from .visuals import b"),
        ("systems/tracking/a.py", "from ..numerics.geometry import world"),
        ("systems/numerics/a.py", "import numpy"),
        ("diagrams/social/networks.py", "from ...hardware_io.social import matrix_network"),
        ("diagrams/station/hardware.py", "from ...hardware_io.mocap import pose_source"),
    ],
)
def test_an_import_downwards_is_allowed(file, line):
    assert upward_imports(line, Path(file)) == []


def test_imports_inside_the_package_are_relative():
    def absolute(source, file):
        ours = re.compile(r"^\s*(?:from|import) +(?:sightfield|systems|diagrams|hardware_io)\b.*")
        return [line for line in source.splitlines() if ours.match(line)]

    assert reports(MODULES, absolute) == []


def test_numerics_do_not_name_pydrake():
    def drake(source, file):
        return [name for name in imports_of(source, file) if name.split(".")[0] == "pydrake"]

    assert reports(NUMERICS, drake) == []


def test_importing_every_numerics_module_loads_no_drake():
    names = ["sightfield." + dotted(file) for file in NUMERICS]
    code = f"""
import importlib, sys
for name in {names!r}:
    importlib.import_module(name)
print("pydrake" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("False\n", "")


def package_graph(sources: dict[Path, str]) -> dict[str, set[str]]:
    """Which other packages each package imports from, a package being a folder of modules.

    A folder and one inside it are two packages. Where a station looks up there is no arrow.

    Args:
        sources: Text of every module.
    """
    package = {dotted(file): ".".join(file.parent.parts) for file in sources}
    graph: dict[str, set[str]] = {name: set() for name in package.values()}
    for file, source in sources.items():
        own = package[dotted(file)]
        for name in imports_of(source, file):
            if file in STATIONS and (floor_of(name) or 0) > (floor_of(own) or 0):
                continue
            # What is imported may be a thing in a module, or in a package's own __init__.
            while name and name not in package:
                name = name.rpartition(".")[0]
            if name and package[name] != own:
                graph[own].add(package[name])
    return graph


def circles(graph: dict[str, set[str]]) -> set[tuple[str, ...]]:
    """The shortest circle through each arrow of a graph that lies on one.

    An arrow that closes a circle is on a circle of the result, and there are at most as many
    circles as arrows, however tangled the graph is. Each begins with its least package.
    """
    found = set()
    for start, ends in graph.items():
        for end in ends:
            way = shortest_way(graph, end, start)
            if way:
                least = way.index(min(way))
                found.add(way[least:] + way[:least])
    return found


def shortest_way(graph: dict[str, set[str]], start: str, end: str) -> tuple[str, ...]:
    """Packages on the shortest way along the arrows, both ends included; () if there is none."""
    ways, seen = [(start,)], {start}
    # A way is taken up after all that are shorter, of equal ones the first by name.
    for way in ways:
        if way[-1] == end:
            return way
        ahead = sorted(graph[way[-1]] - seen)
        seen.update(ahead)
        ways += [(*way, package) for package in ahead]
    return ()


def circles_of(imports: dict[str, str]) -> set[tuple[str, ...]]:
    """Circles among modules of which each has one line."""
    return circles(package_graph({Path(file): line for file, line in imports.items()}))


def test_packages_form_no_circles():
    found = circles_of({str(file): read(file) for file in MODULES})
    assert sorted(found) == [], "a circle: cut it where the dependency is weakest"


THREE = {
    "systems/a/m.py": "from ..b.m import thing",
    "systems/b/m.py": "from ..c import m",
    "systems/c/m.py": "def late():\n    from .. import a",
    "systems/a/__init__.py": "",
}


@pytest.mark.parametrize(
    ("imports", "expected"),
    [
        (
            {"systems/a/m.py": "from ..b import m", "systems/b/m.py": "from ..a.m import thing"},
            {("systems.a", "systems.b")},
        ),
        (
            {"systems/a/m.py": "from .b.m import thing", "systems/a/b/m.py": "from ..m import it"},
            {("systems.a", "systems.a.b")},
        ),
        # What a package's own __init__ offers is of that package.
        (
            {
                "systems/a/__init__.py": "from .m import thing",
                "systems/a/m.py": "from ..b.m import it",
                "systems/b/m.py": "from ..a import thing",
            },
            {("systems.a", "systems.b")},
        ),
        (THREE, {("systems.a", "systems.b", "systems.c")}),
        # A short cut inside a circle is one more.
        (
            THREE | {"systems/b/n.py": "from ..a.m import thing"},
            {("systems.a", "systems.b", "systems.c"), ("systems.a", "systems.b")},
        ),
        # The station takes from above what simulation is swapped for; below, it is like others.
        (
            {
                "diagrams/station/hardware.py": "from ..game import play",
                "diagrams/game.py": "from .station.hardware import swap",
            },
            {("diagrams", "diagrams.station")},
        ),
    ],
)
def test_a_circle_of_packages_is_seen(imports, expected):
    assert circles_of(imports) == expected


@pytest.mark.parametrize(
    "imports",
    [
        {"systems/a/m.py": "from .n import thing", "systems/a/n.py": "from .m import it"},
        {"systems/a/m.py": "from ..b import m", "systems/b/m.py": "import numpy"},
        {name: line for name, line in THREE.items() if name != "systems/c/m.py"},
        {
            "diagrams/station/hardware.py": "from ...hardware_io.mocap import poses",
            "hardware_io/mocap.py": "from ..diagrams.station.hardware import swap",
        },
    ],
)
def test_what_leads_nowhere_back_is_no_circle(imports):
    assert circles_of(imports) == set()


def test_every_module_says_what_it_is_for():
    undocumented = [str(file) for file in SOURCES if not ast.get_docstring(ast.parse(read(file)))]
    assert undocumented == []


def test_nothing_is_left_for_later():
    later = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|XX" + r"X|NotImplement" + r"ed\w*)\b")
    assert reports(SOURCES, lambda source, file: later.findall(source)) == []


def test_only_the_command_line_prints():
    def prints(source, file):
        return [
            f"line {node.lineno}"
            for node in ast.walk(ast.parse(source))
            if isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "print"
        ]

    libraries = [file for file in MODULES if file.parts[:2] != ("diagrams", "commands")]
    assert reports(libraries, prints) == []


def test_programs_that_are_started_leave_signals_of_the_terminal_to_those_who_start_them():
    def belongs_to_the_terminal(source, file):
        return [
            f"line {node.lineno}"
            for node in ast.walk(ast.parse(source))
            if isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and ast.unparse(node.func).startswith("subprocess.")
            and not any(
                word.arg == "start_new_session" and ast.unparse(word.value) == "True"
                for word in node.keywords
            )
        ]

    assert reports(MODULES, belongs_to_the_terminal) == []


def constants_given_twice(source: str, file: Path) -> list[str]:
    """Constants of a module that a later line gives another value, which all functions then see."""
    seen: set[str] = set()
    found = []
    for node in ast.parse(source).body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        names = [each for target in targets for each in ast.walk(target)]
        for name in (each.id for each in names if isinstance(each, ast.Name)):
            if name.isupper() and name in seen:
                found.append(f"line {node.lineno}: {name}")
            seen.add(name)
    return found


def test_every_constant_is_given_once():
    assert reports(MODULES, constants_given_twice) == []


def test_a_constant_that_is_given_twice_is_seen():
    assert constants_given_twice("A, B = 1, 2\nC = 3\nB = 4\n", Path("a.py")) == ["line 3: B"]


def unexplained_ignores(source: str, file: Path) -> list[str]:
    """Ignores of ruff or pyright without words beside them or in a comment line above."""
    ignore = re.compile(r"#\s*(?:noqa|type:\s*ignore|pyright:\s*ignore)(?P<rest>[^#]*)(?P<why>.*)")
    lines = source.splitlines()
    found = []
    for number, line in enumerate(lines):
        match = ignore.search(line)
        if match and not re.search(r"[a-z]{2,} +[a-z]{2,}", match["rest"] + match["why"]):
            above = lines[number - 1].lstrip() if number else ""
            if not above.startswith("# "):
                found.append(f"line {number + 1}: {line.strip()}")
    return found


def test_every_ignore_carries_its_reason():
    assert reports(SOURCES, unexplained_ignores) == []


def test_an_ignore_without_a_reason_is_seen():
    mark = "# no" + "qa"
    assert unexplained_ignores(f"x = 1  {mark}: E501", Path("a.py"))
    assert not unexplained_ignores(f"x = 1  {mark}: E501  # a table reads best", Path("a.py"))


def test_no_file_names_a_place_on_somebodys_machine():
    place = re.compile(r"(?<![\w.:/*-])/(?:home|root|Users|work|mnt)/[\w.-]+|\b[A-Z]:\\\w+")
    texts = [file for file in FILES if file.suffix not in (".png", ".jpg", ".pgm", ".html")]
    assert reports(texts, lambda source, file: place.findall(source)) == []

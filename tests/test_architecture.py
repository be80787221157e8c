"""The house rules that a program can check, read from the sources."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# Imports run from a higher floor to a lower one, or stay on it.
FLOORS = {"systems.numerics": 0, "systems": 1, "diagrams": 2, "hardware_io": 3}

# The modules that swap simulation for the real thing, one for robots and one for the social
# network: they alone look up to it.
STATIONS = {Path("diagrams/station/hardware.py"), Path("diagrams/social/networks.py")}

LINES_PER_FILE = 300
MODULES_PER_FOLDER = 14


def project_files() -> list[Path]:
    """Files of the project, committed or about to be, relative to its root."""
    # CI may run as another user than the owner of the checkout.
    git = ["git", "-c", "safe.directory=*", "ls-files", "-z", "-co", "--exclude-standard"]
    listed = subprocess.run(git, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    files = sorted({Path(name) for name in listed.split("\0") if name})
    return [file for file in files if (ROOT / file).is_file()]


FILES = project_files()
SOURCES = [file for file in FILES if file.suffix == ".py"]
MODULES = [file for file in SOURCES if file.parts[0] in ("systems", "diagrams", "hardware_io")]
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


def test_no_file_is_long():
    def length(source, file):
        lines = source.count("\n")
        return [f"{lines} lines"] if lines > LINES_PER_FILE else []

    assert reports(SOURCES, length) == []


def test_no_folder_is_crowded():
    folders = [file.parent for file in MODULES if file.name != "__init__.py"]
    crowded = {str(f): folders.count(f) for f in folders if folders.count(f) > MODULES_PER_FOLDER}
    assert crowded == {}


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

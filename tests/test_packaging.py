"""The wheel holds what is on disk, the lock covers what is declared, and the names are ours."""

import re
import sys
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]
SETUPTOOLS = PYPROJECT["tool"]["setuptools"]

# "sightfield.systems" -> "systems": where each part of the package lies on disk.
PARTS = SETUPTOOLS["package-dir"]


def shipped_files() -> set[str]:
    """Every source and data file of the parts, by its path in the wheel."""
    return {
        f"{name.replace('.', '/')}/{path.relative_to(ROOT / folder).as_posix()}"
        for name, folder in PARTS.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def run_from_wheel(wheel_places, wheel_folder, run_program) -> Callable[[str], str]:
    """A function that runs code which sees the wheel and the dependencies alone."""
    prelude = f"import sys; sys.path += {wheel_places!r}\n"
    options = ["-I", "-S", "-c"]
    return lambda code: run_program(sys.executable, *options, prelude + code, cwd=wheel_folder)


def test_every_package_on_disk_is_listed():
    on_disk = {
        ".".join([name, *path.parent.relative_to(ROOT / folder).parts])
        for name, folder in PARTS.items()
        for path in (ROOT / folder).rglob("*.py")
    }
    assert sorted(SETUPTOOLS["packages"]) == sorted(on_disk)


def test_every_listed_package_is_a_regular_package():
    for package in SETUPTOOLS["packages"]:
        part = ".".join(package.split(".")[:2])
        folder = ROOT.joinpath(PARTS[part], *package.split(".")[2:])
        assert (folder / "__init__.py").is_file(), package


def test_the_wheel_holds_every_source_and_data_file_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    packaged = {name for name in names if ".dist-info/" not in name}
    assert packaged == shipped_files()


def test_the_wheel_says_that_it_is_typed(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert "sightfield/py.typed" in names


def test_the_wheel_holds_the_thesis_scenario(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert "sightfield/diagrams/scenarios/thesis_3v4.yaml" in names


def test_every_module_of_the_installed_wheel_imports_from_it(wheel_folder, run_from_wheel):
    modules = sorted(
        path.relative_to(wheel_folder).with_suffix("").as_posix().replace("/", ".")
        for path in (wheel_folder / "sightfield").rglob("*.py")
        if path.name not in ("__init__.py", "__main__.py")
    )
    code = f"""
import importlib, pathlib
for name in {modules!r}:
    file = pathlib.Path(importlib.import_module(name).__file__)
    assert file.is_relative_to({str(wheel_folder)!r}), (name, file)
print("imported", len({modules!r}))
"""
    assert run_from_wheel(code) == f"imported {len(modules)}\n"


def test_the_command_of_the_installed_wheel_exists(run_from_wheel):
    code = """
from importlib.metadata import distribution
(command,) = distribution("sightfield").entry_points
print(command.name, callable(command.load()))
"""
    assert run_from_wheel(code) == "sightfield True\n"


@pytest.mark.parametrize("name", sorted(PARTS.values()))
def test_bare_folder_names_are_not_importable(name, run_from_wheel, run_program, tmp_path):
    code = f"import importlib.util; print(importlib.util.find_spec({name!r}))"
    assert run_from_wheel(code) == "None\n"
    assert run_program(sys.executable, "-I", "-c", code, cwd=tmp_path) == "None\n"


PIN = re.compile(
    r"(?P<name>[a-z0-9-]+)==(?P<version>[\w.]+)( ; (?P<marker>[^\\]+?))?"
    r"(?P<hashes>( \\\n    --hash=sha256:[0-9a-f]{64})+)\n"
)


def read_lock(name: str) -> dict[str, tuple[str, str]]:
    """Each requirement of a lock file: its version and its hashes. Anything else fails."""
    text = (ROOT / "requirements" / f"{name}.txt").read_text()
    assert PIN.sub("", text) == "", "a lock holds pins and hashes: no address, path or remark"
    pins = {pin["name"]: (pin["version"], pin["hashes"]) for pin in PIN.finditer(text)}
    assert len(pins) == len(PIN.findall(text)), "one version of each, for every Python"
    return pins


@pytest.mark.parametrize(
    ("lock", "declared"),
    [
        ("build", PYPROJECT["build-system"]["requires"]),
        ("run", PROJECT["dependencies"]),
        ("dev", PROJECT["dependencies"] + PROJECT["optional-dependencies"]["dev"]),
        ("dev", PROJECT["optional-dependencies"]["social"]),
    ],
)
def test_the_lock_pins_what_is_declared(lock, declared):
    pins = read_lock(lock)
    for line in declared:
        requirement = Requirement(line)
        version, _ = pins[requirement.name.lower()]
        assert requirement.specifier.contains(version), f"{line}, but the lock has {version}"


def test_running_and_testing_use_the_same_versions():
    assert read_lock("run").items() <= read_lock("dev").items()


@pytest.mark.parametrize("name", ["drake", "numpy", "scipy", "numba", "shapely", "matplotlib"])
def test_the_lock_holds_the_files_of_several_platforms(name):
    _, hashes = read_lock("run")[name]
    assert hashes.count("sha256:") > 3

"""The wheel holds what is on disk, the lock covers what is declared, and the names are ours."""

import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]
SETUPTOOLS = PYPROJECT["tool"]["setuptools"]

# "sightfield.systems" -> "systems": where each part of the package lies on disk.
PARTS = SETUPTOOLS["package-dir"]


def run(*command: object, **options: object) -> str:
    """Run a command that must succeed, and return what it printed."""
    done = subprocess.run(
        [str(word) for word in command],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        **options,  # type: ignore[call-overload]  # passed through as given
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def shipped_files() -> set[str]:
    """Every source and data file of the parts, by its path in the wheel."""
    return {
        f"{name.replace('.', '/')}/{path.relative_to(ROOT / folder).as_posix()}"
        for name, folder in PARTS.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """A wheel, built from a copy so that no earlier build leaks into it."""
    source = tmp_path_factory.mktemp("source")
    for file in ("pyproject.toml", PROJECT["readme"], *PROJECT["license-files"]):
        shutil.copy(ROOT / file, source)
    for folder in (*PARTS.values(), "tests"):
        caches = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, source / folder, ignore=caches)
    out = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index"]
    run(*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", out, source)
    (built,) = out.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def target(wheel, tmp_path_factory) -> Path:
    """A fresh folder with nothing but the wheel installed into it."""
    folder = tmp_path_factory.mktemp("target")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"]
    run(*pip, "--target", folder, wheel)
    return folder


def run_from(target: Path, code: str) -> str:
    """Run code that sees the wheel in `target` and the dependencies, but no editable install."""
    places = [str(target), sysconfig.get_path("purelib"), sysconfig.get_path("platlib")]
    # -S leaves out the .pth files of site-packages, by which an editable install is found.
    prelude = f"import sys; sys.path += {places!r}\n"
    return run(sys.executable, "-I", "-S", "-c", prelude + code, cwd=target)


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
    for part in PARTS:
        assert f"{part.replace('.', '/')}/py.typed" in names


def test_the_wheel_holds_the_thesis_scenario(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert "sightfield/diagrams/scenarios/thesis_3v4.yaml" in names


def test_every_module_of_the_installed_wheel_imports_from_it(target):
    modules = sorted(
        path.relative_to(target).with_suffix("").as_posix().replace("/", ".")
        for path in (target / "sightfield").rglob("*.py")
        if path.name not in ("__init__.py", "__main__.py")
    )
    code = f"""
import importlib, pathlib
for name in {modules!r}:
    file = pathlib.Path(importlib.import_module(name).__file__)
    assert file.is_relative_to({str(target)!r}), (name, file)
print("imported", len({modules!r}))
"""
    assert run_from(target, code) == f"imported {len(modules)}\n"


def test_the_command_of_the_installed_wheel_exists(target):
    code = """
from importlib.metadata import distribution
(command,) = distribution("sightfield").entry_points
print(command.name, callable(command.load()))
"""
    assert run_from(target, code) == "sightfield True\n"


@pytest.mark.parametrize("name", sorted(PARTS.values()))
def test_bare_folder_names_are_not_importable(name, target, tmp_path):
    code = f"import importlib.util; print(importlib.util.find_spec({name!r}))"
    assert run_from(target, code) == "None\n"
    assert run(sys.executable, "-I", "-c", code, cwd=tmp_path) == "None\n"


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

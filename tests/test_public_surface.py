"""What the stories offer is the public interface: whole, typed, and all that the pages import."""

import ast
import importlib
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sightfield
import sightfield.all

ROOT = Path(__file__).resolve().parents[1]
STORIES = [name for name in sightfield.__all__ if name != "all"]
TUTORIALS = sorted((ROOT / "tutorials").rglob("*.ipynb"))
PAGES = [ROOT / name for name in ("README.md", "BENCHMARKS.md", "CONTRIBUTING.md")]
PAGES += sorted((ROOT / "docs").rglob("*.md"))


def story(name: str):
    return importlib.import_module(f"sightfield.{name}")


def imports_in(text: str) -> list[tuple[str, list[str]]]:
    """What a text imports from us: module and names of each statement, wherever in it.

    In prose and blocks alike, so that a line that nobody runs counts too.
    """
    line = r"^[ >]*(?:from (sightfield[\w.]*) import (\([^)]*\)|.*)|import (sightfield.*))$"
    return [
        (source or whole.split()[0].rstrip(","), re.findall(r"\w+", re.sub(r"#.*", "", names)))
        for source, names, whole in re.findall(line, text, re.MULTILINE)
    ]


def not_offered(text: str) -> list[str]:
    """What a text imports from us that no story offers."""
    found = []
    for module, names in imports_in(text):
        name = module.partition(".")[2]
        offered = story(name).__all__ if name in sightfield.__all__ else []
        found += [f"{module}.{each}" for each in names if each not in offered]
        found += [module] if name not in sightfield.__all__ else []
    return found


def code_of(notebook: Path) -> str:
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    return "\n".join("".join(each["source"]) for each in cells if each["cell_type"] == "code")


def test_every_name_leads_to_one_thing_and_no_name_to_two():
    everything = [name for each in STORIES for name in story(each).__all__]
    assert len(everything) > 400
    assert sorted(everything) == sightfield.all.__all__
    for each in STORIES:
        for name in story(each).__all__:
            assert getattr(sightfield.all, name) is getattr(story(each), name), name


def test_a_name_is_what_its_definition_calls_it():
    """Nothing is offered under another name than its own."""
    for name in sightfield.all.__all__:
        thing = getattr(sightfield.all, name)
        if isinstance(thing, type):
            # That of a template for one scalar has the scalar behind its name.
            assert thing.__name__.startswith(name), name


def test_what_is_not_offered_is_an_error_that_says_so():
    with pytest.raises(AttributeError, match=r"'sightfield.tracking' has no attribute 'Grid'"):
        sightfield.tracking.Grid  # noqa: B018  # looking it up is what fails
    with pytest.raises(ImportError, match="cannot import name 'Grid'"):
        from sightfield.all import Grid  # noqa: F401  # importing it is what fails


def test_a_name_is_listed_before_it_is_loaded():
    assert set(dir(sightfield)) >= {"tracking", "all"}
    assert "MakeTracking" in dir(sightfield.tracking)


def test_only_what_is_asked_for_is_loaded_and_all_of_it_without_any_extra():
    code = """
import sys
import sightfield, sightfield.all, sightfield.tracking
print("numpy" in sys.modules)
from sightfield.all import make_world
from sightfield.planning import Trailer
print("pydrake" in sys.modules, make_world.__module__)
from sightfield.tracking import LineOfSight
print("pydrake" in sys.modules)
# None stands for a package that cannot be imported.
extras = "digi serial nio motioncapture rosbags mcap cflib distributed"
sys.modules |= dict.fromkeys(extras.split())
from sightfield.all import *
print(set(sightfield.all.__all__) <= set(dir()))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split("\n") == [
        "False",
        "False sightfield.systems.numerics.geometry.world",
        "True",
        "True",
        "",
    ], done.stderr


@pytest.mark.parametrize("page", [*PAGES, *TUTORIALS], ids=lambda page: page.name)
def test_pages_and_tutorials_import_from_the_stories_alone(page):
    text = code_of(page) if page.suffix == ".ipynb" else page.read_text(encoding="utf-8")
    assert not_offered(text) == []


@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_tutorial_has_at_most_three_lines_of_imports(tutorial):
    assert 1 <= len(imports_in(code_of(tutorial))) <= 3


@pytest.mark.parametrize(
    "text",
    [
        "from sightfield.systems.tracking import LineOfSight",
        "    from sightfield.diagrams.tracking.run import (\n    run_tracking,\n)",
        "import sightfield.diagrams.tracking.run as run",
        "from sightfield.tracking import LineOfSight, Grid",
    ],
)
def test_an_import_from_deeper_is_seen(text):
    assert not_offered(text) != []


def test_readme_and_surface_pass_a_strict_check_of_types(wheel_folder, tmp_path):
    """In the wheel, where the stubs lie beside what they name."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^```python\n(.*?)^```$", readme, re.MULTILINE | re.DOTALL)
    (tmp_path / "example.py").write_text(example, encoding="utf-8")
    checked = ["example.py", *map(str, (wheel_folder / "sightfield").glob("*.pyi"))]
    options = {"typeCheckingMode": "strict", "extraPaths": [str(wheel_folder)], "include": checked}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(options), encoding="utf-8")
    program = Path(sys.executable).with_name("basedpyright")
    done = subprocess.run(
        [program, "--pythonpath", sys.executable], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.stdout.startswith("0 errors, 0 warnings"), done.stdout + done.stderr


def test_every_story_has_a_module_and_a_stub():
    modules = {path.stem for path in (ROOT / "surface").glob("*.py")} - {"__init__", "_lazy"}
    assert modules == set(sightfield.__all__)
    for name in modules:
        stub = ast.parse((ROOT / "surface" / f"{name}.pyi").read_text(encoding="utf-8"))
        assert all(isinstance(line, ast.ImportFrom) for line in stub.body)
        assert story(name).__doc__

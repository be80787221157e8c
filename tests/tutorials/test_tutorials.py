"""Every tutorial runs against the installed wheel, and reads as the others do."""

import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tutorials"
TUTORIALS = sorted(FOLDER.glob("*.ipynb"))
LINES_PER_CELL = 30

each_tutorial = pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.stem)


def read(path: Path) -> nbformat.NotebookNode:
    return nbformat.read(path, as_version=4)


def sources(notebook: nbformat.NotebookNode, kind: str) -> list[str]:
    return [cell.source for cell in notebook.cells if cell.cell_type == kind]


def test_tutorials_are_numbered_from_zero_and_listed_in_the_readme():
    assert [path.name.partition("_")[0] for path in TUTORIALS] == [str(k) for k in range(10)]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [path.name for path in TUTORIALS if f"](tutorials/{path.name})" not in readme] == []


@each_tutorial
def test_a_tutorial_runs_on_the_wheel_alone(path, execute, tmp_path, wheel_folder):
    notebook = read(path)
    asked = "import sightfield\nprint(*sightfield.__path__)"
    notebook.cells.append(nbformat.v4.new_code_cell(asked))
    execute(notebook, tmp_path)
    assert notebook.cells[-1].outputs[0].text.strip() == str(wheel_folder / "sightfield")
    shown = [
        output
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert shown, "a tutorial shows a picture"


@each_tutorial
def test_a_tutorial_is_stored_without_what_a_run_leaves(path):
    notebook = read(path)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    clear = all(cell.execution_count is None and not cell.outputs for cell in code)
    assert clear, "`make format` clears it"
    assert not any(cell.metadata for cell in notebook.cells)
    assert set(notebook.metadata) == {"kernelspec", "language_info"}
    assert dict(notebook.metadata.language_info) == {"name": "python"}
    assert path.read_text(encoding="utf-8") == nbformat.writes(notebook) + "\n"


@each_tutorial
def test_a_tutorial_begins_with_its_title_and_ends_with_exercises(path):
    cells = read(path).cells
    number = path.name.partition("_")[0]
    assert cells[0].cell_type == cells[-1].cell_type == "markdown"
    assert re.match(rf"# {number} · \w.*\n", cells[0].source)
    last = cells[-1].source.partition("## Exercises\n")[2]
    assert len(re.findall(r"^\d\. ", last, re.MULTILINE)) >= 3


@each_tutorial
def test_cells_are_short_equations_are_numbered_and_claims_are_checked(path):
    notebook = read(path)
    code = sources(notebook, "code")
    assert [cell for cell in code if len(cell.splitlines()) > LINES_PER_CELL] == []
    text = "\n".join(sources(notebook, "markdown"))
    tags = re.findall(r"\\tag\{(\d+)\}", text)
    assert tags
    assert tags == [str(k + 1) for k in range(len(tags))]
    assert sum("assert" in cell for cell in code) >= 3


@each_tutorial
def test_links_lead_somewhere(path):
    text = "\n".join(sources(read(path), "markdown"))
    local = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in link]
    assert [link for link in local if not (FOLDER / link).exists()] == []


@pytest.mark.parametrize("command", [["check"], ["format", "--check"]], ids=lambda words: words[0])
def test_tutorials_are_clean(command):
    ruff = Path(sys.executable).with_name("ruff")
    done = subprocess.run(
        [ruff, *command, *TUTORIALS], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr

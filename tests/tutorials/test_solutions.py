"""The lecturers' notebooks: every solution runs on the wheel, and belongs to a tutorial."""

import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

TUTORIALS = Path(__file__).resolve().parents[2] / "tutorials"
SOLUTIONS = sorted((TUTORIALS / "solutions").glob("*.ipynb"))

each_solution = pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)


def read(path):
    return nbformat.read(path, as_version=4)


def test_every_tutorial_has_its_solutions():
    assert [each.name for each in SOLUTIONS] == sorted(
        each.name for each in TUTORIALS.glob("*.ipynb")
    )


@each_solution
def test_the_solutions_run_on_the_wheel_alone(path, execute, tmp_path):
    execute(read(path), tmp_path)


@each_solution
def test_every_exercise_has_its_solution_and_the_tutorial_does_not_give_it_away(path):
    tutorial, solution = read(TUTORIALS / path.name), read(path)
    exercises = tutorial.cells[-1].source.partition("## Exercises\n")[2]
    asked = re.findall(r"^(\d)\. ", exercises, re.MULTILINE)
    parts = [cell.source for cell in solution.cells if cell.cell_type == "markdown"]
    solved = [found[1] for part in parts if (found := re.match(r"## (\d)\. ", part))]
    assert solved == asked
    assert all("solutions" not in cell.source for cell in tutorial.cells)
    assert f"](../{path.name})" in parts[0]


@each_solution
def test_solutions_are_stored_clean_and_each_is_checked(path):
    notebook = read(path)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.execution_count is None and not cell.outputs for cell in code)
    parts = "\n".join(cell.source for cell in notebook.cells).split("\n## ")[1:]
    assert all("assert" in part for part in parts)
    assert path.read_text(encoding="utf-8") == nbformat.writes(notebook) + "\n"
    for command in (["check"], ["format", "--check"]):
        ruff = Path(sys.executable).with_name("ruff")
        done = subprocess.run(
            [ruff, *command, path],
            cwd=TUTORIALS.parent,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr

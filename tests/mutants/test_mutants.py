"""The list of mutants fits the sources and the tests, and the tests find faults."""

import ast
import runpy
from dataclasses import replace
from pathlib import Path

import pytest

RUN = runpy.run_path(str(Path(__file__).with_name("run.py")))
ROOT, MUTANTS = RUN["ROOT"], RUN["read_mutants"]()

each_mutant = pytest.mark.parametrize("mutant", MUTANTS, ids=[each.name for each in MUTANTS])


def test_every_mutant_has_a_name_of_its_own():
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS) > 0


@each_mutant
def test_a_mutant_changes_one_place_of_a_source_and_leaves_it_python(mutant):
    source = (ROOT / mutant.file).read_text(encoding="utf-8")
    assert source.count(mutant.old) == 1
    faulty = mutant.applied(source)
    # Not comments or line breaks alone.
    assert ast.dump(ast.parse(faulty)) != ast.dump(ast.parse(source))


@each_mutant
def test_the_test_that_kills_a_mutant_exists_in_the_folder_that_mirrors_its_file(mutant):
    path, *_, name = mutant.test.split("[")[0].split("::")
    functions = ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8")))
    assert name in [each.name for each in functions if isinstance(each, ast.FunctionDef)]
    floor, *story, _ = Path(mutant.file).parts
    floor, *story = story if story[0] == "numerics" else (floor, *story)
    assert Path(path).is_relative_to(Path("tests", floor, story[0]))


def test_a_fault_fails_its_test_and_none_passes_it():
    (mutant,) = [each for each in MUTANTS if each.name == "a step follows the heading it ends with"]
    assert RUN["try_mutant"](mutant)[0] == RUN["FAILED"]
    assert RUN["try_mutant"](replace(mutant, new=mutant.old))[0] == RUN["PASSED"]

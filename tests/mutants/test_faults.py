"""Faults are those of the operators, and each leaves a source Python; a sample finds its tests."""

import ast
import runpy
from pathlib import Path

import pytest

HERE = Path(__file__).parent
faults_of = runpy.run_path(str(HERE / "faults.py"))["faults_of"]


@pytest.mark.parametrize(
    ("source", "faulty"),
    [
        ("a < b", {"a <= b"}),
        ("a is not b", {"a is b"}),
        ("a < b < c", {"a <= b < c", "a < b <= c"}),
        ("(a) + (b)", {"(a) - (b)"}),
        ("a += b", {"a -= b"}),
        ("a and b and c", {"a or b and c", "a and b or c"}),
        ("not a", {"(a)"}),
        ("x = 3", {"x = 4"}),
        ("x = 0.5", {"x = 0.75"}),
        ("x = 0.0", {"x = 1.0"}),
        ("x = True", {"x = False"}),
        ("é(b)", {"pass"}),
        ("if a:\n    b", {"if (not (a)):\n    b"}),
        ("x = 'é' < a", {"x = 'é' <= a"}),
        # What does nothing when it runs holds no faults.
        ("def f(a: 3) -> 4: ...", set()),
        ("'1 + 1'", set()),
        ("f'{a + 1}'", set()),
        ("(a  # + b\n + c)", set()),
        ("'a' + b", set()),
    ],
)
def test_each_operator_makes_its_faults(source, faulty):
    assert {fault.made_in(source) for fault in faults_of(source)} == faulty


def test_faults_of_a_whole_file_leave_it_python_and_another_one():
    source = (HERE / "faults.py").read_text(encoding="utf-8")
    as_it_is = ast.dump(ast.parse(source))
    found = faults_of(source)
    assert len(found) > 20
    for fault in found:
        assert ast.dump(ast.parse(fault.made_in(source))) != as_it_is
        assert source[: fault.start].count("\n") + 1 == fault.line


def test_a_fault_is_looked_for_in_the_tests_of_its_story_and_found_once():
    sample = runpy.run_path(str(HERE / "sample.py"))
    first, others = sample["tests_of"](Path("systems/numerics/harvest/turns/words.py"))
    assert any(test.endswith("turns/test_words.py") for test in first)
    story = ("tests", "numerics", "harvest")
    assert {Path(test).parts[:3] for test in (*first, *others)} == {story}
    modules = {str(each.file): each for each in sample["read_modules"]()}
    units = modules["systems/numerics/units.py"]
    fault = next(each for each in units.faults if each.new == "is not")
    tried = sample["try_fault"](units, fault)
    assert str(tried["found"]).startswith("tests/numerics/test_units.py::")


def test_every_module_with_faults_has_tests_on_its_floor():
    sample = runpy.run_path(str(HERE / "sample.py"))
    files = [each.file for each in sample["read_modules"]()]
    assert [str(file) for file in files if not any(sample["tests_of"](file))] == []


def test_a_test_whose_parameters_are_named_after_the_fault_finds_it():
    sample = runpy.run_path(str(HERE / "sample.py"))
    modules = {str(each.file): each for each in sample["read_modules"]()}
    gates = modules["systems/station/gates.py"]
    source = sample["ROOT"].joinpath(gates.file).read_text(encoding="utf-8")
    (fault,) = [each for each in gates.faults if source[: each.start].endswith("STOPPED = 1.0, ")]
    tried = sample["try_fault"](gates, fault)
    assert str(tried["found"]).endswith("unless_the_operator_lets_them[1.0]")


def test_who_imports_a_room_imports_the_files_in_it():
    steps_away = runpy.run_path(str(HERE / "sample.py"))["_steps_away"]
    away = steps_away(Path("diagrams/tracking/scene/tracking_scene.py"))
    # It imports `.scene`, whose `__init__.py` names the file.
    assert away[Path("diagrams/tracking/make_tracking.py")] == 2

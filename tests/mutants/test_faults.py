"""Faults are those of the operators, and each leaves a source Python; a sample finds its tests."""

import ast
import importlib
from collections import Counter
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def load(name):
    """A module beside this file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(HERE))
        return importlib.import_module(name)


faults_of = load("faults").faults_of


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
        ("x = a.reshape(-1)", set()),
        ("x = a.reshape((-1, 2))", {"x = a.reshape((-1, 3))"}),
        ("x = a.reshape(-n)", {"x = a.reshape((n))"}),
        ("x = zip(a, b, strict=True)", set()),
        ("x = find(a, strict=True)", {"x = find(a, strict=False)"}),
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


SAMPLE = load("sample")


class ReachedBy:
    """What `Reach` says of a line: always the same tests."""

    def __init__(self, *tests: str) -> None:
        self.tests = list(tests)

    def chosen(self, file, line, longest):
        return self.tests

    def compiled_with(self, file, line):
        return set()


def module(name):
    (found,) = [each for each in SAMPLE.read_modules() if str(each.file) == name]
    return found


def test_a_fault_is_found_by_a_test_that_fails_with_it_and_passes_without():
    units = module("systems/numerics/units.py")
    fault = next(name for name, each in units.faults.items() if each.new == "is not")
    tried = SAMPLE.try_fault(fault, units, ReachedBy("tests/numerics/test_units.py"))
    assert str(tried["found"]).startswith("tests/numerics/test_units.py::")
    assert SAMPLE.try_fault(fault, units, ReachedBy())["found"] is None
    blind = "tests/numerics/test_checked.py"
    assert SAMPLE.try_fault(fault, units, ReachedBy(blind))["found"] is None


def test_a_test_whose_parameters_are_named_after_the_fault_finds_it():
    gates = module("systems/station/gates.py")
    source = (ROOT / gates.file).read_text(encoding="utf-8")
    places = {name: source[: each.start] for name, each in gates.faults.items()}
    (fault,) = [name for name, place in places.items() if place.endswith("STOPPED = 1.0, ")]
    tried = SAMPLE.try_fault(
        fault, gates, ReachedBy("tests/systems/station/test_station_systems.py")
    )
    assert str(tried["found"]).endswith("unless_the_operator_lets_them[1.0]")


def test_what_is_listed_as_changing_nothing_is_a_fault_of_its_file_and_is_not_drawn():
    drawn = {str(each.file): each.faults for each in SAMPLE.read_modules()}
    for name, same in SAMPLE.equivalents().items():
        source = (ROOT / name).read_text(encoding="utf-8")
        lines = source.splitlines()
        alike, listed = Counter(), set()
        for fault in faults_of(source):
            told = lines[fault.line - 1].strip(), source[fault.start : fault.end], fault.new
            alike[told] += 1
            here = same & {told, (*told, alike[told])}
            assert not here or fault not in drawn.get(name, {}).values()
            listed |= here
        assert listed == same


def test_a_sample_stays_as_it_is_where_other_code_changes():
    modules = SAMPLE.read_modules()
    sample = [name for name, _ in SAMPLE.draw(modules, 200, 3)]
    assert len(set(sample)) == 200
    assert sample[:50] == [name for name, _ in SAMPLE.draw(modules, 50, 3)]
    assert sample != [name for name, _ in SAMPLE.draw(modules, 200, 4)]
    one = next(each for each in modules if any(name in each.faults for name in sample))
    others = [each for each in modules if each is not one]
    kept = [name for name, _ in SAMPLE.draw(others, 200, 3)]
    assert [name for name in sample if name not in one.faults] == kept[
        : len(set(sample) & set(kept))
    ]


@pytest.fixture(scope="module")
def reach(tmp_path_factory):
    """What two quick files of tests reach."""
    folder = tmp_path_factory.mktemp("reach")
    tests = ["tests/numerics/test_units.py", "tests/numerics/tracking/test_small_matching.py"]
    load("reach").record(folder, 1, tests)
    return load("reach").Reach(folder)


def line_of(file, text):
    (found,) = [
        number
        for number, line in enumerate((ROOT / file).read_text().splitlines(), start=1)
        if line.startswith(text)
    ]
    return found


def test_tests_reach_what_they_run_and_not_what_others_do(reach):
    units = Path("systems/numerics/units.py")
    found = reach.tests(units, line_of(units, "    return Unit(factor, *powers)"))
    assert found
    assert {test.partition("::")[0] for test in found} == {"tests/numerics/test_units.py"}
    assert reach.chosen(units, 1, 1.0) != []
    assert reach.tests(Path("systems/numerics/harvest/trucks.py"), 1) == set()


def test_tests_reach_compiled_functions_over_those_that_call_them(reach):
    matching = Path("systems/numerics/tracking/assignment/matching.py")
    inside = line_of(matching, "def _padded") + 1
    found = reach.tests(matching, inside)
    assert {test.partition("::")[0] for test in found} == {
        "tests/numerics/tracking/test_small_matching.py"
    }
    assert matching in reach.compiled_with(matching, inside)

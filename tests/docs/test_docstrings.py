"""Every public class and function is documented: parameters, shapes, units, errors, source.

What a program can check of that, read from the sources:

- modules, classes, functions and methods have a docstring, whose first paragraph is a sentence;
- a parameter stands in `Args:`, or the text names it; not if its type is one of ours, which says
  what it is;
- the entry of an array gives its shape, that of a float its unit in brackets, or says that it is a
  pure number; so for what is returned, and for fields, whose entry may be a comment;
- what refuses bad input by a `require` says what it raises; commands end with exit code 2;
- a LeafSystem has its block and its table of ports, and its source;
- equations that are cited exist in the thesis.
"""

import ast
import re

import pytest
from sources import ROOT, Module, Parameter, Thing, read_module, read_modules

# Options of commands are documented by their help.
COMMANDS = ("diagrams", "commands")

# Types that say what a parameter is, beside those of the package.
SPEAKING = re.compile(
    r"pydrake|matplotlib|pathlib|shapely|rich|casadi|pydantic|datetime|types|typer|yaml|serial|nio"
)
# A docstring may lead to another one that says it.
ELSEWHERE = r"(?:[Aa]s (?:in|of)|[Ss]ee|from|by|[Aa] rule on|'s) `\w+"
SHAPE = re.compile(rf"[Ss]hape|[Ss]izes?\b|\(\w+,|{ELSEWHERE}")
UNIT = re.compile(rf"\[[^\]]+\]|{ELSEWHERE}")
ALIKE = re.compile(
    r"(?:[Aa]rguments(?: and results)?|[Ff]or the rest) (?:as in|as those of|see) `|; see `\w+`"
)
PURE = re.compile(
    r"""\b(?:shares?|parts?|fractions?|ratios?|factors?|weights?|probabilit\w+|chances?|correlation
    |scale|times|radii|pixels?|counts?|in\ units|units\ of|from\ 0|0\ to\ 1|orders?|slope|numbers?
    |simulated\ seconds|Letters|gain|quantile|confidence|between\ 0|above\ 0|as\ in|K_D|no\ unit
    |squared\ deviations|at\ most\ 1|jitter|saturation|brightness|light
    |of\ the\ (?:whole|state|picture))\b|in\ [([]0,\ 1""",
    re.VERBOSE | re.IGNORECASE,
)
LAST_EQUATION = {"2": 15, "3": 31}


def entries(doc: str) -> dict[str, str]:
    """What `Args:` and `Attributes:` say of each name."""
    found: dict[str, str] = {}
    for section in re.findall(r"^(?:Args|Attributes):\n((?:(?: +.*)?\n)+)", doc + "\n", re.M):
        for names, text in re.findall(r"^    ([*\w, ]+): ?((?:.*\n(?:     .*\n)*))", section, re.M):
            found |= {name.strip(" *"): text for name in names.split(",")}
    return found


def speaks(parameter: Parameter, module: Module) -> bool:
    """Whether a type says what a parameter is."""
    own = {thing.name for thing in module.things if thing.kind == "class"}
    for name in re.findall(r"[A-Za-z_]\w*", parameter.annotation):
        origin = module.names.get(name, "")
        if name in own | {"Callable", "Generator", "Scalar"} or origin.startswith("sightfield."):
            return True
        if SPEAKING.match(origin):
            return True
    return False


def is_named(name: str, words: set[str]) -> bool:
    """Whether a text names a parameter, in the singular or the plural, or word by word."""
    forms = {name, name.rstrip("s"), name + "s", name.lstrip("_"), name.rstrip("_")}
    return bool(forms & words) or set(name.split("_")) <= words


def quantity_faults(each: Parameter, text: str) -> list[str]:
    """What a float's or an array's entry lacks."""
    faults = []
    if re.match(r"(?:tuple\[)?np\.ndarray", each.annotation) and not SHAPE.search(text):
        faults.append(f"no shape of {each.name}")
    is_number = re.fullmatch(r"float(?: \| None)?", each.annotation)
    if is_number and not UNIT.search(text) and not PURE.search(text):
        faults.append(f"no unit of {each.name}")
    return faults


def faults_of(thing: Thing, module: Module, around: str = "") -> list[str]:
    """What the docstring of a class, a function or a method lacks.

    Args:
        thing: Which.
        module: Where it is.
        around: Docstrings of what it stands in, which hold for it too.
    """
    if not thing.doc:
        return ["no docstring"]
    faults = []
    if not re.search(r"[.:?]$", thing.doc.split("\n\n")[0].strip()):
        faults.append("its first paragraph is no sentence")
    listed, context = entries(thing.doc), f"{thing.doc}\n{around}"
    words = set(re.findall(r"\w+", context))
    if module.file.parts[:2] != COMMANDS:
        for each in thing.parameters:
            if each.name not in listed and ALIKE.search(thing.doc):
                continue
            if not (each.name in listed or speaks(each, module) or is_named(each.name, words)):
                faults.append(f"nothing on {each.name}")
            else:
                faults += quantity_faults(each, listed.get(each.name, context))
        returned = Parameter("what is returned", thing.returns)
        faults += quantity_faults(returned, context)
    for each in thing.fields:
        text = listed.get(each.name, "") + each.note
        if text or each.name in words or speaks(each, module):
            faults += quantity_faults(each, text or context)
        else:
            faults.append(f"nothing on {each.name}")
    says = re.search(r"InvalidInput|[Rr]efuse", thing.doc) or module.file.parts[:2] == COMMANDS
    if thing.refuses and not says:
        faults.append("nothing on what it raises")
    if thing.is_system:
        wanted = (".. pydrake_system::\n\n", "\nport ", "\nSource: ")
        faults += [f"no {mark.strip()}" for mark in wanted if mark not in thing.doc]
    return faults


def faults_in(module: Module) -> list[str]:
    """Every fault of a module, with its line."""
    found = [] if module.doc else ["1: no docstring"]
    for thing in module.things:
        found += [f"{thing.line}: {thing.name}: {x}" for x in faults_of(thing, module, module.doc)]
        for method in thing.methods:
            around = f"{module.doc}\n{thing.doc}"
            name = f"{method.line}: {thing.name}.{method.name}"
            found += [f"{name}: {fault}" for fault in faults_of(method, module, around)]
    return found


MODULES = read_modules()


def test_there_is_much_to_check():
    assert sum(len(module.things) for module in MODULES) > 900


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.file.as_posix())
def test_everything_public_is_documented(module):
    assert faults_in(module) == []


def test_cited_equations_exist():
    cited = [
        (module.file, chapter, int(number))
        for module in MODULES
        for doc in (module.doc, *(thing.doc for thing in module.things))
        for chapter, number in re.findall(r"\(([23])\.(\d+)\)", doc)
    ]
    assert len(cited) > 80
    assert [each for each in cited if not 1 <= each[2] <= LAST_EQUATION[each[1]]] == []


def test_every_option_of_a_command_has_help():
    options = [
        (module.file.name, node.lineno, {word.arg for word in node.keywords})
        for module in MODULES
        if module.file.parts[:2] == COMMANDS
        for node in ast.walk(ast.parse((ROOT / module.file).read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
        and ast.unparse(node.func) in ("typer.Option", "typer.Argument")
    ]
    assert len(options) > 50
    assert [each for each in options if "help" not in each[2]] == []


GOOD = '''
"""Shoving."""
import numpy as np
from sightfield.systems.numerics.errors import require_positive

def push(force: float, places: np.ndarray) -> np.ndarray:
    """Push points to the right.

    Args:
        force: How hard [N].
        places: Shape (n, 2) [m].

    Returns:
        Shape (n, 2) [m].

    Raises:
        InvalidInput: The force is not positive.
    """
    require_positive("force", force)
    return places + force
'''


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("", "", None),
        (" [N]", "", "no unit of force"),
        ("places: Shape (n, 2) [m].", "places: Points.", "no shape of places"),
        ("        places: Shape (n, 2) [m].\n", "", "nothing on places"),
        ("Push points", "Push places", None),
        ("force: How hard [N].", "strength: How hard [N].", None),
        ("Push points to the right.", "Push points", "its first paragraph is no sentence"),
        ("InvalidInput: The force", "ValueError: The force", "nothing on what it raises"),
        ("force: float", "strength: float", "nothing on strength"),
    ],
)
def test_what_is_missing_is_seen(old, new, fault, tmp_path):
    folder = tmp_path / "systems"
    folder.mkdir()
    file = folder / "pushes.py"
    file.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    faults = [each.split(": ", 2)[2] for each in faults_in(read_module(file, tmp_path))]
    assert faults == ([fault] if fault else [])

"""What the sources say of themselves: public modules, classes and functions, by their syntax.

Nothing is imported: compiled functions and Drake's templates look the same here as plain ones.
"""

import ast
import copy
import inspect
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

# Elsewhere, if a copy of docs/ is built.
ROOT = Path(os.environ.get("SIGHTFIELD_SOURCES", Path(__file__).resolve().parents[2]))
PARTS = ("systems", "diagrams", "hardware_io")

# Names that `sightfield.systems.numerics.checked` has for numbers with a rule.
RULED_NUMBERS = dict.fromkeys(
    ("Finite", "Sized", "Positive", "PositiveSized", "NonNegative", "NonNegativeSized", "Chance"),
    "float",
)
RULED_NUMBERS["Count"] = "int"

Routine = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Parameter:
    """A parameter of a function, a field of a dataclass, or a constant.

    Attributes:
        name: As in the source.
        annotation: Its type as in the source; empty if it has none.
        note: The comment above or beside a field or a constant; empty for parameters.
        value: Of a constant, if it is short, or what a field is without being told; else empty.
    """

    name: str
    annotation: str
    note: str = ""
    value: str = ""


@dataclass(frozen=True)
class Thing:
    """A public class, function or method.

    Attributes:
        kind: "class", "function", "method" or "property".
        name: Its own name.
        signature: With parentheses; empty for properties. Of a class: names and defaults.
        bases: Of a class whose fields are its parameters, as in the source.
        by_name: Its fields can be given by name only.
        doc: The docstring, cleaned, and behind that of a class its constructor's; empty: none.
        parameters: Of the function, or of a class's constructor; not `self`.
        returns: The annotation of what it returns; empty if it has none.
        fields: Of a dataclass or an enumeration.
        methods: Public ones of a class.
        refuses: It raises InvalidInput, by itself or by a `require`.
        is_system: It is a LeafSystem.
        line: Where it begins.
    """

    kind: str
    name: str
    signature: str
    doc: str
    parameters: tuple[Parameter, ...]
    returns: str
    fields: tuple[Parameter, ...]
    methods: tuple["Thing", ...]
    refuses: bool
    is_system: bool
    line: int
    bases: tuple[str, ...] = ()
    by_name: bool = False


@dataclass(frozen=True)
class Module:
    """A module of the package.

    Attributes:
        name: As it is imported, with `sightfield.`.
        file: Relative to the root of the project.
        doc: The docstring, cleaned.
        things: Public classes and functions in the order of the source.
        names: Where each imported name comes from, by the name in this module.
        constants: Public names that are assigned, in the order of the source, with their comments.
    """

    name: str
    file: Path
    doc: str
    things: tuple[Thing, ...]
    names: dict[str, str]
    constants: tuple[Parameter, ...]


def read_modules(root: Path = ROOT) -> list[Module]:
    """Every module of the package whose name is public, packages before their modules."""
    files = [file for part in PARTS for file in sorted((root / part).rglob("*.py"))]
    public = [file for file in files if not re.search(r"(?:^|/)_(?!_init__)", file.as_posix())]
    return [read_module(file, root) for file in public]


@cache
def read_module(file: Path, root: Path = ROOT) -> Module:
    """Read one module."""
    text = file.read_text(encoding="utf-8")
    tree = ast.parse(text)
    place = file.relative_to(root).with_suffix("").parts
    is_package = place[-1] == "__init__"
    name = ".".join(["sightfield", *(place[:-1] if is_package else place)])
    package = name if is_package else name.rpartition(".")[0]
    lines = text.splitlines()
    # Of overloads the last is what runs; a template's class is also assigned to a name.
    things = {thing.name: thing for thing in _things(tree.body, lines)}
    assigned = [each for each in _constants(tree.body, lines) if each.name not in things]
    constants = {each.name: each for each in reversed(assigned)}
    return Module(
        name=name,
        file=file.relative_to(root),
        doc=inspect.cleandoc(ast.get_docstring(tree) or ""),
        things=tuple(things.values()),
        names=_imported(tree, package),
        constants=tuple(reversed(constants.values())),
    )


def _things(body: list[ast.stmt], lines: list[str]) -> Iterator[Thing]:
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield _class(node, node.name, lines)
        elif isinstance(node, Routine) and not node.name.startswith("_"):
            inner = [each for each in node.body if isinstance(each, ast.ClassDef)]
            if inner and any("TemplateSystem" in ast.unparse(d) for d in node.decorator_list):
                yield _class(inner[0], node.name.rstrip("_"), lines)
            else:
                yield _function(node, "function")


def _class(node: ast.ClassDef, name: str, lines: list[str]) -> Thing:
    routines = [each for each in node.body if isinstance(each, Routine)]
    builders = [each for each in routines if each.name in ("__init__", "_construct")]
    checks = [each for each in routines if each.name == "__post_init__"]
    bases = [ast.unparse(base) for base in node.bases]
    is_data = any("dataclass" in each for each in _decorators(node))
    is_data |= bool({"NamedTuple", "BaseModel"} & set(bases))
    fields = tuple(_fields(node, lines)) if is_data else ()
    by_name = any("kw_only=True" in each for each in _decorators(node))
    methods = [
        _function(each, "property" if _is_property(each) else "method")
        for each in routines
        # `Do...` overrides what Drake has documented.
        if not each.name.startswith(("_", "Do")) and "setter" not in str(_decorators(each))
    ]
    return Thing(
        kind="class",
        name=name,
        signature=_names_and_defaults(builders[0]) if builders else signature_of(fields, by_name),
        doc="\n\n".join(filter(None, (ast.get_docstring(each) for each in (node, *builders[:1])))),
        parameters=_parameters(builders[0]) if builders else (),
        returns="",
        fields=fields,
        methods=tuple(methods),
        refuses=any(_refuses(each) for each in builders + checks),
        is_system=any(re.match(r"(?:LeafSystem|VectorSystem)", base) for base in bases),
        line=node.lineno,
        bases=tuple(bases) if is_data and not builders else (),
        by_name=by_name,
    )


def signature_of(fields: Iterable[Parameter], by_name: bool) -> str:
    """The signature of a dataclass, from its fields and whether they are given by name only."""
    told = [each.name + (f"={each.value}" if each.value else "") for each in fields]
    return f"({', '.join(['*'] * (by_name and bool(told)) + told)})"


def _names_and_defaults(builder: Routine) -> str:
    """The signature of a constructor, without annotations."""
    found = copy.deepcopy(builder.args)
    for each in (*found.posonlyargs, *found.args, found.vararg, *found.kwonlyargs, found.kwarg):
        if each is not None:
            each.annotation = None
    # Drake hands a converter to the templates.
    names = re.sub(r"^(?:self|cls)(?:, |$)", "", ast.unparse(found))
    return f"({re.sub(r'^converter(?:=None)?(?:, |$)', '', names)})"


def _function(node: Routine, kind: str) -> Thing:
    return Thing(
        kind=kind,
        name=node.name,
        signature="" if kind == "property" else _signature(node),
        doc=inspect.cleandoc(ast.get_docstring(node) or ""),
        parameters=_parameters(node),
        returns=ast.unparse(node.returns) if node.returns else "",
        fields=(),
        methods=(),
        refuses=_refuses(node),
        is_system=False,
        line=node.lineno,
    )


def _decorators(node: Routine | ast.ClassDef) -> list[str]:
    return [ast.unparse(each) for each in node.decorator_list]


def _is_property(node: Routine) -> bool:
    return any("property" in each for each in _decorators(node))


def _parameters(node: Routine) -> tuple[Parameter, ...]:
    found = node.args
    named = [*found.posonlyargs, *found.args, found.vararg, *found.kwonlyargs, found.kwarg]
    return tuple(
        Parameter(each.arg, ast.unparse(each.annotation) if each.annotation else "")
        for each in named
        # Drake hands a converter to the templates.
        if each is not None and each.arg not in ("self", "cls", "converter")
    )


def _signature(node: Routine) -> str:
    arguments = ast.unparse(node.args)
    arguments = re.sub(r"^(?:self|cls)(?:, |$)", "", arguments)
    return f"({arguments})" + (f" -> {ast.unparse(node.returns)}" if node.returns else "")


def _refuses(node: Routine) -> bool:
    calls = [each.func for each in ast.walk(node) if isinstance(each, ast.Call)]
    names = {each.id for each in calls if isinstance(each, ast.Name)}
    return any(re.match(r"require(?:_|$)|InvalidInput$", name) for name in names)


def _fields(node: ast.ClassDef, lines: list[str]) -> Iterator[Parameter]:
    note, end, kind = "", 0, ""
    for each in node.body:
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
            annotation = _without_rules(each.annotation)
            # A comment holds for all numbers in the lines that follow it without a gap.
            goes_on = each.lineno == end + 1 and {annotation, kind} <= {"float", "int"}
            note = _note(each, lines) or (note if goes_on else "")
            end, kind = each.end_lineno or each.lineno, annotation
            if not each.target.id.startswith("_") and "ClassVar" not in annotation:
                yield Parameter(each.target.id, annotation, note, _default(each.value))


def _default(value: ast.expr | None) -> str:
    """What a field is without being told; `X()` where a factory X makes it."""
    if isinstance(value, ast.Call) and ast.unparse(value.func) == "field":
        made = {each.arg: each.value for each in value.keywords}
        factory = made.get("default_factory")
        if isinstance(factory, ast.Lambda):
            return _default(factory.body)
        return f"{ast.unparse(factory)}()" if factory else _default(made.get("default"))
    text = ast.unparse(value) if value else ""
    worked_out = value and any(isinstance(each, ast.comprehension) for each in ast.walk(value))
    return "..." if worked_out or len(text) > _SHORT else text


# Longer values than this are not shown.
_SHORT = 72


def _value(node: ast.expr | None) -> str:
    """What a constant is, if that is short and plain; of a dictionary its keys."""
    if node is None:
        return ""
    if isinstance(node, ast.Dict) and all(isinstance(key, ast.Constant) for key in node.keys):
        text = ", ".join(ast.unparse(key) for key in node.keys if key)
        return text if len(text) <= _SHORT else ""
    try:
        ast.literal_eval(node)
    except ValueError:
        return ""
    text = ast.unparse(node)
    return text if len(text) <= _SHORT else ""


def _without_rules(node: ast.expr) -> str:
    """A field's type without the rule that `sightfield.systems.numerics.checked` gives it."""
    if isinstance(node, ast.Subscript) and ast.unparse(node.value) == "Annotated":
        parts = node.slice
        return ast.unparse(parts.elts[0] if isinstance(parts, ast.Tuple) else parts)
    name = ast.unparse(node)
    return RULED_NUMBERS.get(name, name)


def _note(node: ast.stmt, lines: list[str]) -> str:
    """The comment in the lines above a statement, or at its end."""
    above = []
    for line in reversed(lines[: node.lineno - 1]):
        if not line.strip().startswith("# "):
            break
        above.insert(0, line.strip()[2:])
    beside = lines[(node.end_lineno or node.lineno) - 1].partition("  # ")[2]
    beside = re.sub(r"(?:type|pyright): .*|noqa.*", "", beside).strip()
    together = " ".join(above)
    # What stands above several goes on beside each.
    return f"{together.removesuffix('.')}: {beside}" if above and beside else together or beside


def _imported(tree: ast.Module, package: str) -> dict[str, str]:
    """Full names of what a module imports, and of what it defines itself."""
    names = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                names[alias.asname or alias.name.split(".")[0]] = alias.name
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")
            base = above[: len(above) - node.level + 1] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            for alias in node.names:
                names[alias.asname or alias.name] = f"{stem}.{alias.name}"
    return names


def _constants(body: list[ast.stmt], lines: list[str]) -> Iterator[Parameter]:
    for node in body:
        if isinstance(node, ast.Assign):
            targets = [each for each in node.targets if isinstance(each, ast.Name)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            targets = [node.target]
        else:
            continue
        for each in targets:
            if not each.id.startswith("_"):
                yield Parameter(each.id, "", _note(node, lines), _value(node.value))

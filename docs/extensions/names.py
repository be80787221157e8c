"""Where a name in a text leads: the one place that has it, or none."""

import ast
import re
from dataclasses import replace
from functools import cache

from sources import Module, Parameter, Thing, read_modules, signature_of


@cache
def places() -> dict[str, Thing | None]:
    """Everything that has an entry in the API pages, by its full name; None for constants."""
    found: dict[str, Thing | None] = {}
    for module in read_modules():
        found[module.name] = None
        for constant in module.constants:
            found[f"{module.name}.{constant.name}"] = None
        for thing in module.things:
            found[f"{module.name}.{thing.name}"] = thing
            for method in thing.methods:
                found[f"{module.name}.{thing.name}.{method.name}"] = method
    return found


def with_inherited(thing: Thing, module: Module) -> Thing:
    """A dataclass with the fields of its bases before its own, as it is made."""
    fields: dict[str, Parameter] = {}
    for base in reversed(thing.bases):
        place = name_in(module.name, base.partition("[")[0])
        above = places().get(place) if place else None
        if place and above and above.kind == "class":
            there = modules()[place.rpartition(".")[0]]
            fields |= {each.name: each for each in with_inherited(above, there).fields}
    if not fields:
        return thing
    # A field that is declared anew keeps its place.
    fields |= {each.name: each for each in thing.fields}
    every = tuple(fields.values())
    return replace(thing, fields=every, signature=signature_of(every, thing.by_name))


@cache
def modules() -> dict[str, Module]:
    """Every module by its full name."""
    return {module.name: module for module in read_modules()}


@cache
def _by_ending() -> dict[str, list[str]]:
    endings: dict[str, list[str]] = {}
    for name in places():
        parts = name.split(".")
        for k in range(len(parts)):
            endings.setdefault(".".join(parts[k:]), []).append(name)
    return endings


def full_names(text: str) -> list[str]:
    """Full names of what ends in a dotted name; those of classes before those of methods."""
    found = _by_ending().get(text, [])
    # A method shares its last name with many things: alone it names none of them. A module often
    # has the name of what is in it.
    tops = [name for name in found if name.rpartition(".")[0] in modules()]
    return [name for name in tops if name not in modules()] or tops or found


def name_in(module: str, text: str) -> str | None:
    """Full name of what a module calls by a name: its own, what it imports, or the only one."""
    head, dot, rest = text.partition(".")
    own = f"{module}.{text}"
    if own in places():
        return own
    if module in modules() and head in modules()[module].names:
        imported = origin(modules()[module].names[head])
        return imported + dot + rest if imported and imported + dot + rest in places() else None
    found = full_names(text)
    return found[0] if len(found) == 1 and len(text) > 2 else None


def origin(name: str) -> str | None:
    """Where a name is defined that a package may only pass on; None if it is not ours."""
    if name in places():
        return name
    package, _, last = name.rpartition(".")
    passed_on = modules()[package].names.get(last) if package in modules() else None
    return origin(passed_on) if passed_on else None


def qualified(signature: str, module: Module) -> str:
    """A signature whose annotations have our classes by their full names."""
    tree = ast.parse(f"def f{signature}: pass")
    for node in ast.walk(tree):
        if isinstance(node, ast.arg | ast.FunctionDef):
            field = "annotation" if isinstance(node, ast.arg) else "returns"
            annotation = getattr(node, field)
            if annotation is not None:
                setattr(node, field, _Full(module).visit(annotation))
    return re.sub(r"^def f|:\s+pass$", "", ast.unparse(tree))


def full_annotation(annotation: str, module: Module) -> str:
    """An annotation with our classes by their full names."""
    return ast.unparse(_Full(module).visit(ast.parse(annotation, mode="eval").body))


class _Full(ast.NodeTransformer):
    """Replaces names by where they lead."""

    def __init__(self, module: Module):
        self.module = module

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """A name of ours becomes a dotted one."""
        own = f"{self.module.name}.{node.id}"
        name = own if own in places() else origin(self.module.names.get(node.id, ""))
        return ast.parse(name, mode="eval").body if name else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        """What a command's option says beside its type is its help."""
        if isinstance(node.value, ast.Name) and node.value.id == "Annotated":
            assert isinstance(node.slice, ast.Tuple)
            return self.visit(node.slice.elts[0])
        return self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        """A name in quotes is a name, where it is not one of `Literal`."""
        if isinstance(node.value, str) and f"{self.module.name}.{node.value}" in places():
            return self.visit(ast.parse(node.value, mode="eval").body)
        return node

"""Markup for systems and names: boxes with ports, and roles that only take what exists."""

import html
import inspect
import re
from typing import Any

import yaml
from docutils import nodes
from names import full_names, modules, name_in, places
from sources import ROOT
from sphinx import addnodes
from sphinx.util.docutils import SphinxDirective, SphinxRole

# What a role leaves in the page, and what it complains of. Any: docutils's lists are invariant.
Written = tuple[list[Any], list[nodes.system_message]]

_BLOCK = re.compile(r"^\.\. pydrake_system::\n\n((?:(?: {4}.*)?\n)+)", re.MULTILINE)
_TABLE = re.compile(r"^(=+(?: +=+)+)\nport .*\n\1\n(?:.+\n)+?\1$", re.MULTILINE)


def ports_of(doc: str) -> tuple[str, list[str], list[str]] | None:
    """Name, input ports and output ports by the block of a docstring; None if it has none."""
    block = _BLOCK.search(doc + "\n")
    return _ports(inspect.cleandoc(block[1])) if block else None


def _ports(block: str) -> tuple[str, list[str], list[str]]:
    ports = yaml.safe_load(block)
    return ports["name"], ports.get("input_ports") or [], ports.get("output_ports") or []


def fault_of(name: str) -> str:
    """What is wrong with a name as `{api}` takes it; empty if nothing."""
    name, _, part = name.partition(":")
    found = full_names(name)
    if len(found) != 1:
        return f"{name} must name one thing; got {found}"
    thing = places()[found[0]]
    parts = []
    if thing:
        _, inputs, outputs = ports_of(thing.doc) or ("", [], [])
        named = [each.name for each in (*thing.parameters, *thing.fields)]
        parts = [*named, *inputs, *outputs]
    return f"{name} must have {part}; got {parts}" if part and part not in parts else ""


def fault_of_port(name: str) -> str:
    """What is wrong with a port as `{port}` takes it; empty if nothing."""
    system, _, port = name.rpartition(".")
    found = full_names(system)
    thing = places()[found[0]] if len(found) == 1 else None
    ports = ports_of(thing.doc) if thing else None
    return "" if ports and port in ports[1] + ports[2] else f"{name} must be a port of a system"


def box_of(name: str, inputs: list[str], outputs: list[str]) -> nodes.Node:
    """A system as a box, inputs on the left, outputs on the right."""
    columns = [
        '<div class="{}">{}</div>'.format(
            side, "".join(f"<span>{html.escape(port)}</span>" for port in ports)
        )
        for side, ports in (("inputs", inputs), ("outputs", outputs))
    ]
    box = f'<div class="name">{html.escape(name)}</div>'
    text = f'<div class="drake-system">{columns[0]}{box}{columns[1]}</div>'
    return nodes.raw("", text, format="html")


def table_of(doc: str) -> list[nodes.Node]:
    """The table of ports of a docstring, if it has one."""
    found = _TABLE.search(doc)
    if not found:
        return []
    lines = found[0].splitlines()
    starts = [match.start() for match in re.finditer("=+", lines[0])]
    cuts = list(zip(starts, [*starts[1:], None], strict=True))
    rows = [[line[a:b].strip() for a, b in cuts] for line in [lines[1], *lines[3:-1]]]
    group = nodes.tgroup(cols=len(cuts))
    group += [nodes.colspec(colwidth=1) for _ in cuts]
    head, body = nodes.thead(), nodes.tbody()
    for part, some in ((head, rows[:1]), (body, rows[1:])):
        for cells in some:
            row = nodes.row()
            row += [nodes.entry("", nodes.paragraph("", cell)) for cell in cells]
            part += row
    group += [head, body]
    return [nodes.table("", group)]


class Box(SphinxDirective):
    """`.. pydrake_system::`: the box of a docstring's block."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """The box."""
        return [box_of(*_ports("\n".join(self.content)))]


class System(SphinxDirective):
    """`{system}`: a system in a story: a link to it, its first sentence, box and table of ports."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """What the docstring says of the ports."""
        name = self.arguments[0]
        fault = fault_of(name)
        thing = None if fault else places()[full_names(name)[0]]
        ports = ports_of(thing.doc) if thing else None
        if thing is None or ports is None:
            raise self.error(fault or f"{name} must be a system")
        # The page is to be made again when the docstring changes.
        module = modules()[full_names(name)[0].rpartition(".")[0]]
        for file in (ROOT / module.file, __file__):
            self.env.note_dependency(str(file))
        first = " ".join(thing.doc.split("\n\n")[0].split()).replace("`", "")
        link = _link(self, full_names(name)[0], thing.name)
        words = nodes.paragraph("", "", link, nodes.Text(f": {first}"))
        return [words, box_of(*ports), *table_of(thing.doc)]


class Port(SphinxRole):
    """`{port}`: a port, written System.port; a link to the system."""

    def run(self) -> Written:
        """The link, or a warning where there is no such port."""
        fault = fault_of_port(self.text)
        if fault:
            return _warned(self, fault)
        system = self.text.rpartition(".")[0]
        return [_link(self, full_names(system)[0], self.text)], []


class Api(SphinxRole):
    """`{api}`: something in the API pages, by the end of its name; after a colon, a part of it."""

    def run(self) -> Written:
        """The link, or a warning where the name leads nowhere or to several places."""
        fault = fault_of(self.text)
        if fault:
            return _warned(self, fault)
        name, colon, part = self.text.partition(":")
        found = full_names(name)[0]
        last = name if found.rpartition(".")[0] not in modules() else name.rpartition(".")[2]
        return [_link(self, found, f"{last}, {part}" if colon else last)], []


class Quoted(SphinxRole):
    """`name` in a docstring: a link where that name leads somewhere, code anyway."""

    def run(self) -> Written:
        """The link or the code."""
        found = name_in(self.env.ref_context.get("py:module", ""), self.text)
        if found:
            return [_link(self, found, self.text)], []
        return [nodes.literal(self.rawtext, self.text)], []


def _link(place: SphinxRole | SphinxDirective, target: str, text: str) -> nodes.Node:
    reference = addnodes.pending_xref(
        text, refdomain="py", reftype="obj", reftarget=target, refwarn=True
    )
    reference["refdoc"] = place.env.docname
    reference += nodes.literal(text, text)
    return reference


def _warned(role: SphinxRole, message: str) -> Written:
    problem = role.inliner.reporter.warning(message, line=role.lineno)
    return [nodes.literal(role.rawtext, role.text)], [problem]


def setup(app) -> dict[str, bool]:
    """Tell Sphinx the directives and roles."""
    app.add_directive("pydrake_system", Box)
    app.add_directive("system", System)
    for name, role in (("port", Port()), ("api", Api()), ("quoted", Quoted())):
        app.add_role(name, role)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Writes the API pages into docs/api, from the sources: one for each story and each package."""

from collections.abc import Iterator
from pathlib import Path
from textwrap import indent

from docstrings import as_restructured_text
from names import full_annotation, qualified, with_inherited
from sources import Module, Thing, read_modules
from stories import GROUPS, stories, story_doc

FLOORS = {
    "Systems": "sightfield.systems",
    "Numerics": "sightfield.systems.numerics",
    "Diagrams": "sightfield.diagrams",
    "Hardware": "sightfield.hardware_io",
}


def write_api_pages(folder: Path) -> None:
    """Write the pages of all packages and their index; drop those of packages that are gone."""
    packages: dict[str, list[Module]] = {}
    for module in read_modules():
        is_package = module.file.name == "__init__.py"
        package = module.name if is_package else module.name.rpartition(".")[0]
        packages.setdefault(package, []).append(module)
    inside = {name: "\n".join(_page(name, found)) for name, found in sorted(packages.items())}
    offered = {f"sightfield.{name}": "\n".join(_story(name)) for name in stories()}
    pages = offered | inside
    pages["index"] = "\n".join(_index(list(offered), list(inside)))
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.rst"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        file = folder / f"{name}.rst"
        # Sphinx reads again what is newer.
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def setup(app) -> dict[str, bool]:
    """Have Sphinx call it before it looks for pages."""
    app.connect("builder-inited", lambda app: write_api_pages(Path(app.srcdir) / "api"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _index(offered: list[str], packages: list[str]) -> Iterator[str]:
    yield "API"
    yield "===\n"
    yield "What these stories offer is the public interface, each by a name of its own, so that"
    yield "``from sightfield.all import ...`` has them too.\n"
    yield ".. toctree::\n   :maxdepth: 1\n"
    yield from (f"   {name}" for name in offered)
    yield ""
    yield "Behind it is the code as it lies in folders, with the ports of every system. What no"
    yield "story offers may change without notice.\n"
    floors = sorted(FLOORS.items(), key=lambda item: -len(item[1]))
    floor_of = {
        package: next(title for title, floor in floors if package.startswith(floor))
        for package in packages
    }
    for title in FLOORS:
        yield f"{title}\n{'-' * len(title)}\n\n.. toctree::\n   :maxdepth: 1\n"
        yield from (f"   {name}" for name in packages if floor_of[name] == title)
        yield ""


def _story(story: str) -> Iterator[str]:
    title = f"sightfield.{story}"
    yield f"{title}\n{'=' * len(title)}\n"
    yield f".. py:module:: {title}\n"
    yield as_restructured_text(story_doc(story)) + "\n"
    for group in GROUPS:
        offers = [each for each in stories()[story] if each.group == group]
        if offers:
            yield f"{group}\n{'-' * len(group)}\n"
        for each in offers:
            first = as_restructured_text(each.words).strip()
            yield f":py:obj:`{each.name} <{each.place}>`\n{indent(first, '   ')}\n"


def _page(package: str, modules: list[Module]) -> Iterator[str]:
    title = package.removeprefix("sightfield.")
    yield f"{title}\n{'=' * len(title)}\n"
    for module in modules:
        is_package = module.name == package
        if not is_package:
            last = module.name.rpartition(".")[2]
            yield f"{last}\n{'-' * len(last)}\n"
        yield f".. py:module:: {module.name}\n"
        yield as_restructured_text(module.doc) + "\n"
        for constant in module.constants:
            yield f".. py:data:: {constant.name}"
            yield f"   :value: {constant.value}\n" if constant.value else ""
            yield indent(as_restructured_text(constant.note), "   ") + "\n"
        for thing in module.things:
            yield from _entry(thing, module)


def _entry(thing: Thing, module: Module) -> Iterator[str]:
    kind = {"property": "property", "method": "method", "class": "class"}.get(thing.kind)
    thing = with_inherited(thing, module)
    signature = thing.signature
    if thing.kind in ("method", "function"):
        signature = qualified(signature, module)
    yield f".. py:{kind or 'function'}:: {thing.name}{signature}\n"
    text = as_restructured_text(thing.doc, thing)
    for each in thing.fields:
        known = f".. attribute:: {each.name}\n"
        text = text.replace(known, f"{known}   :type: {full_annotation(each.annotation, module)}\n")
    body = [text, ""]
    for method in thing.methods:
        body += _entry(method, module)
    yield indent("\n".join(body), "   ") + "\n"

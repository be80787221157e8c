"""The public interface: what the stories offer, read from the stubs of the surface."""

import ast
from dataclasses import dataclass
from functools import cache

from names import origin, places
from sources import ROOT, Parameter, Thing, read_module

SURFACE = ROOT / "surface"


@dataclass(frozen=True)
class Offer:
    """A name of a story.

    Attributes:
        name: As it is imported from the story.
        place: Its full name where it is defined.
        thing: The class or function, None for a constant.
        constant: The constant, None for a class or a function.
    """

    name: str
    place: str
    thing: Thing | None
    constant: Parameter | None

    @property
    def words(self) -> str:
        """What its docstring or comment says first, in one line; empty if there is none."""
        text = self.thing.doc if self.thing else self.constant.note if self.constant else ""
        return " ".join(text.split("\n\n")[0].split())

    @property
    def group(self) -> str:
        """The heading that it belongs under."""
        if self.thing is None:
            return "Constants"
        if self.thing.is_system:
            return "Systems"
        if self.thing.kind == "class":
            return "Scenarios, results and other classes"
        return "Diagrams" if self.name[0].isupper() else "Functions"


GROUPS = ("Systems", "Diagrams", "Scenarios, results and other classes", "Functions", "Constants")


@cache
def stories() -> dict[str, tuple[Offer, ...]]:
    """What each story offers, by its name below `sightfield.`, in the order of the alphabet."""
    stubs = [file for file in sorted(SURFACE.glob("*.pyi")) if file.stem not in ("__init__", "all")]
    return {stub.stem: tuple(_offers(stub.read_text(encoding="utf-8"))) for stub in stubs}


def story_doc(story: str) -> str:
    """The docstring of a story."""
    return read_module(SURFACE / f"{story}.py").doc


def _offers(stub: str) -> list[Offer]:
    found = []
    for line in ast.parse(stub).body:
        assert isinstance(line, ast.ImportFrom)
        for alias in line.names:
            # The instance of a template for float is made from the template.
            name = f"sightfield.{line.module}.{alias.name}"
            place = origin(name) or origin(name.rstrip("_")) or name
            module, _, last = place.rpartition(".")
            thing = places().get(place)
            constant = None
            if thing is None and place in places():
                constants = {each.name: each for each in _module(module)}
                constant = constants.get(last)
            found.append(Offer(alias.name, place, thing, constant))
    return sorted(found, key=lambda each: each.name.lower())


def _module(name: str) -> tuple[Parameter, ...]:
    parts = name.removeprefix("sightfield.").split(".")
    file = ROOT.joinpath(*parts)
    return read_module(file / "__init__.py" if file.is_dir() else file.with_suffix(".py")).constants

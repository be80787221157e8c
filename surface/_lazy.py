"""Names that are imported when somebody asks for them, from where a stub says that they are.

Each module of the surface has a stub beside it (`tracking.pyi` beside `tracking.py`) with lines as
`from .systems.tracking import LineOfSight as LineOfSight`. Editors and checkers of types read it as
they read any stub; at run time the same lines say where each name is. So a name is written once,
and `import sightfield` loads neither Drake nor NumPy.
"""

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path


def lazily(
    module: str, file: str
) -> tuple[Callable[[str], object], Callable[[], list[str]], list[str]]:
    """What a module of the surface assigns to `__getattr__`, `__dir__` and `__all__`.

    Args:
        module: Its `__name__`.
        file: Its `__file__`, beside which the stub lies.
    """
    places = _places(Path(file).with_suffix(".pyi"))

    def find(name: str) -> object:
        if name not in places:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        place = places[name]
        found = (
            getattr(import_module(place), name) if place else import_module(f"sightfield.{name}")
        )
        # Whoever asks next finds it there.
        setattr(sys.modules[module], name, found)
        return found

    return find, lambda: sorted(places), sorted(places)


def _places(stub: Path) -> dict[str, str]:
    """The module of each name of a stub; empty for what is itself a module of the surface."""
    places: dict[str, str] = {}
    for line in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(line, ast.ImportFrom):
            place = f"sightfield.{line.module}" if line.module else ""
            for alias in line.names:
                if alias.name == "*":
                    places |= dict.fromkeys(import_module(place).__all__, place)
                else:
                    places[alias.name] = place
    return places

"""API pages tell how classes are made, what constants are, and each of several results."""

import ast

import pytest
from docstrings import as_restructured_text
from names import modules, places, with_inherited
from sources import read_module

SOURCE = '''
"""Things."""
from dataclasses import dataclass, field

# Kinds of shoves.
KINDS = {"soft": 1, "hard": 2}
# At most [N].
MOST = 3.5
# Codes, for `push`.
LEFT = 0  # to the left
TABLE = tuple(range(MOST))


@dataclass(frozen=True, kw_only=True)
class Shove:
    """A shove."""

    # How hard [N].
    force: float = 2.0
    places: list[int] = field(default_factory=list)
    often: int
    angles: tuple[float, ...] = tuple(k / 2 for k in range(4))


class Pusher(LeafSystem):
    """Pushes."""

    def __init__(self, shove: Shove, *, period: float = 0.1, name: str = "pusher") -> None:
        pass
'''


@pytest.fixture
def read(tmp_path):
    (tmp_path / "systems").mkdir()
    file = tmp_path / "systems" / "shoves.py"
    file.write_text(SOURCE, encoding="utf-8")
    return read_module(file, tmp_path)


def test_classes_show_their_defaults(read):
    shove, pusher = read.things
    assert shove.signature == "(*, force=2.0, places=list(), often, angles=...)"
    assert pusher.signature == "(shove, *, period=0.1, name='pusher')"


def test_constants_show_what_they_are_if_that_is_short(read):
    told = {each.name: (each.note, each.value) for each in read.constants}
    assert told == {
        "KINDS": ("Kinds of shoves.", "'soft', 'hard'"),
        "MOST": ("At most [N].", "3.5"),
        "LEFT": ("Codes, for `push`: to the left", "0"),
        "TABLE": ("", ""),
    }


def test_scenarios_show_the_fields_that_they_inherit():
    for name, thing in places().items():
        if thing is not None and thing.kind == "class" and thing.bases:
            module = modules()[name.rpartition(".")[0]]
            shown = with_inherited(thing, module)
            assert {each.name for each in thing.fields} <= {each.name for each in shown.fields}
            # What Sphinx reads it as.
            ast.parse(f"def f{shown.signature.replace('=...', '=0')}: pass")
    name = "sightfield.diagrams.harvest.scenario"
    shown = with_inherited(places()[f"{name}.Disturbances"], modules()[name])
    assert shown.signature.startswith("(*, slowness=0.0, stops=0.0, longest_stop=120.0, seed=0")


@pytest.mark.parametrize(
    ("results", "told"),
    [
        (["The share in [0, 1] (1: no wall)."], ":returns: The share in [0, 1] (1: no wall)."),
        (
            ["near: The first one.", "far: The second one,", "    farther on."],
            ":returns:\n    - ``near``: The first one.\n    - ``far``: The second one,",
        ),
    ],
)
def test_results_are_told_each_by_its_name(results, told):
    lines = "".join(f"    {line}\n" for line in results)
    doc = f"Push.\n\nReturns:\n{lines}\nRaises:\n    InvalidInput: It is heavy.\n"
    text = as_restructured_text(doc)
    assert told in text
    assert "\n\n:raises InvalidInput:" in text

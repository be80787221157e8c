"""What needs an extra that is not installed says what to type, as the pages do."""

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from sightfield.systems.numerics.errors import (
    InvalidInput,
    install_line,
    missing_modules,
    require_extra,
)

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
SOURCES = [
    file for part in ("systems", "diagrams", "hardware_io") for file in (ROOT / part).rglob("*.py")
]
PAGES = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]


def test_one_line_says_what_is_missing_and_what_to_type(monkeypatch):
    monkeypatch.setitem(sys.modules, "digi", None)
    # Another test may have imported it.
    monkeypatch.delitem(sys.modules, "digi.xbee", raising=False)
    assert missing_modules(["json", "digi", "digi.xbee", "no_such.thing"]) == [
        "digi",
        "digi.xbee",
        "no_such.thing",
    ]
    words = (
        r"^`radio` must come with the extra \[hardware\]: pip install '\.\[hardware\]' in the "
        r"checkout; not installed: digi$"
    )
    with pytest.raises(InvalidInput, match=words):
        require_extra("`radio`", "hardware", ["json", "digi"])
    require_extra("`radio`", "hardware", ["json"])


def named_extras(file: Path) -> list[str]:
    """Extras that a module names, where it asks for them."""
    source, found = file.read_text(), []
    # Most do not, and parsing takes its time.
    for node in ast.walk(ast.parse(source)) if "extra" in source else ():
        if isinstance(node, ast.Call):
            called, named = ast.unparse(node.func), []
            if called == "RobotKind":
                named = [word.value for word in node.keywords if word.arg == "extra"]
            elif called in ("require_extra", "install_line"):
                named = node.args[1:2] if called == "require_extra" else node.args
            found += [each.value for each in named if isinstance(each, ast.Constant)]
    return found


def test_every_extra_that_is_asked_for_is_one():
    named = {extra for file in SOURCES for extra in named_extras(file)}
    assert named <= set(EXTRAS)
    assert {"hardware", "mcap", "dds", "cluster", "social", "social-server"} <= named


def test_no_other_line_says_how_to_install():
    own = ROOT / "systems" / "numerics" / "errors.py"
    others = [file for file in SOURCES if file != own and "pip install" in file.read_text()]
    assert others == []


def test_pages_say_the_same_line():
    lines = {install_line(extra).removesuffix(" in the checkout") for extra in EXTRAS}
    said = {line for page in PAGES for line in re.findall(r"pip install '.*?'", page.read_text())}
    assert said <= lines
    assert "pip install '.[hardware]'" in (ROOT / "README.md").read_text()

"""What the documentation holds, and what reads it."""

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"

# The site's extensions read sources; the tests ask the same readers.
sys.path.insert(0, str(DOCS / "extensions"))


@dataclass(frozen=True)
class Page:
    """A page of the site.

    Attributes:
        name: Relative to docs/.
        text: In Markdown.
        blocks: Language and text of each fenced block, in order.
    """

    name: str
    text: str
    blocks: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        return self.name


def read_page(file: Path) -> Page:
    """Read one page."""
    text = file.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return Page(file.relative_to(DOCS).as_posix(), text, tuple(blocks))


PAGES = [read_page(file) for file in sorted(DOCS.rglob("*.md"))]


def pytest_generate_tests(metafunc):
    """A test of `page` holds for every page, of `guide` for those with code that is run.

    One of `lesson` holds for those with commands that are run; other pages' commands are for what
    not everybody has: devices, a server.
    """
    folders = ("index.md", "stories/", "guides/")
    wanted = {
        "page": PAGES,
        "lesson": [
            page
            for page in PAGES
            if page.name.startswith(folders) and any(kind == "sh" for kind, _ in page.blocks)
        ],
        "guide": [page for page in PAGES if any(kind == "python" for kind, _ in page.blocks)],
    }
    for name, some in wanted.items():
        if name in metafunc.fixturenames:
            metafunc.parametrize(name, some, ids=str)


@pytest.fixture(scope="session")
def pages() -> list[Page]:
    """All pages that are written by hand."""
    return PAGES

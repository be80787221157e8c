"""The documentation site builds without a warning, and what it links to is there."""

import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[2]
# What `make docs` writes into docs/.
WRITTEN = shutil.ignore_patterns("api", "commands.rst", "__pycache__")


def build(docs: Path, out: Path) -> subprocess.CompletedProcess:
    """Build a folder of pages, warnings being errors."""
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
    sources = {**os.environ, "SIGHTFIELD_SOURCES": str(ROOT)}
    return subprocess.run(
        [*command, "-d", out / "doctrees", docs, out / "html"],
        env=sources,
        capture_output=True,
        text=True,
        check=False,
    )


class Anchors(HTMLParser):
    """Collects what a page links to, and the places in it that can be linked to."""

    def __init__(self, text: str):
        super().__init__()
        self.targets: list[str] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Note links and ids."""
        found = dict(attrs)
        self.targets += [target for key in ("href", "src") if (target := found.get(key))]
        self.places |= {place for key in ("id",) if (place := found.get(key))}


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The built site, from a copy of docs/: tests write nothing beside the sources."""
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(ROOT / "docs", folder / "docs", ignore=WRITTEN)
    shutil.copy(ROOT / "pyproject.toml", folder)
    done = build(folder / "docs", folder)
    assert done.returncode == 0, done.stderr
    return folder / "html"


def test_every_link_within_the_site_leads_somewhere(site):
    anchors = {
        file.resolve(): Anchors(file.read_text(encoding="utf-8")) for file in site.rglob("*.html")
    }
    assert len(anchors) > 50
    dead = []
    for file, page in anchors.items():
        for target in page.targets:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            place = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            found = place.exists()
            if found and parts.fragment and place in anchors and not parts.path.startswith("_"):
                found = unquote(parts.fragment) in anchors[place].places
            if not found:
                dead.append(f"{file.name}: {target}")
    assert dead == []


def test_nothing_is_fetched_from_another_site(site):
    fetched = re.compile(r"""(?:<script[^>]* src|<link[^>]*stylesheet[^>]* href)="(https?:[^"]+)""")
    assert not [
        match
        for file in site.rglob("*.html")
        for match in fetched.findall(file.read_text(encoding="utf-8"))
    ]


@pytest.mark.parametrize(
    "name", ["api/sightfield.systems.tracking.html", "stories/tracking.html"], ids=["api", "story"]
)
def test_a_page_shows_a_systems_ports(site, name):
    page = (site / name).read_text(encoding="utf-8")
    box = re.search(r'<div class="drake-system">[^\n]*?>Assignment</div>.*?</div></div>', page)
    assert box
    assert all(f"<span>{port}</span>" in box[0] for port in ("sight", "assignment"))
    assert re.search(r"<td><p>sight</p></td>\s*<td><p>Np Ne \+ Np K \+ Ne K</p></td>", page)


@pytest.mark.parametrize("name", ["World", "World.corners"], ids=["type", "attribute"])
def test_short_names_in_signatures_and_texts_lead_to_what_they_name(site, name):
    place = "sightfield.systems.numerics.geometry.html#sightfield.systems.numerics.geometry.world"
    link = re.compile(rf'<a class="reference internal" href="{place}\.{name}"[^>]*>.*?</a>')
    pages = [
        site / f"api/sightfield.{room}.html" for room in ("systems.tracking", "diagrams.tracking")
    ]
    found = [each for file in pages for each in link.findall(file.read_text(encoding="utf-8"))]
    assert found
    assert all(f">{name}<" in each for each in found)


def test_no_markup_is_left_over(site):
    pages = [file.read_text(encoding="utf-8") for file in site.rglob("*.html")]
    words = [re.sub(r"(?s)<pre.*?</pre>|<code.*?</code>|<script.*?</script>", "", x) for x in pages]
    assert not [mark for text in words for mark in re.findall(r":(?:api|port):|\n\.\. |====", text)]


FAULTS = {
    "{port}`LineOfSight.sound`": "LineOfSight.sound must be a port of a system",
    "{api}`no_such_function`": "no_such_function must name one thing",
    "{api}`LineOfSight:listeners`": "LineOfSight must have listeners",
    "[a page](nowhere.md)": "nowhere.md",
    "```{system} NoSystem\n```": "NoSystem must name one thing",
    "```{system} World\n```": "World must be a system",
}


def test_what_leads_nowhere_is_an_error(tmp_path):
    shutil.copytree(ROOT / "docs" / "extensions", tmp_path / "docs" / "extensions")
    text = "\n\n".join(["# Page", *FAULTS])
    (tmp_path / "docs" / "index.md").write_text(text, encoding="utf-8")
    # The API pages take long, and are not what is looked at.
    (tmp_path / "docs" / "conf.py").write_text(
        "import pathlib, sys\n"
        "sys.path.insert(0, str(pathlib.Path(__file__).with_name('extensions')))\n"
        "extensions = ['myst_parser', 'drake_systems']\n"
        "exclude_patterns = ['extensions']\n",
        encoding="utf-8",
    )
    done = build(tmp_path / "docs", tmp_path)
    assert done.returncode != 0
    assert [words for words in FAULTS.values() if words not in done.stderr] == []

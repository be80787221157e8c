"""From exhibits to HTML: contents, then a section each, pictures and style inside."""

import base64
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from importlib import resources

from .exhibits.evidence import VERDICTS, Evidence, Finding, Picture, Table
from .make_exhibits import FAILED, Made

# The weightiest first.
MEANINGS = {FAILED: "could not be made", **VERDICTS}
# How the claims of 2.2.7 are judged, and which colour that has.
_CLAIMS = {"holds": "agrees", "does not hold": "differs", "cannot tell": "cannot tell"}


def make_page(made: Sequence[Made], *, quick: bool, made_with: str) -> str:
    """The whole report.

    Args:
        made: The exhibits in order.
        quick: Whether they were made quickly.
        made_with: Versions and machine, for the foot of the page.

    Returns:
        HTML without any reference to another file or address.
    """
    style = resources.files(__package__ or "").joinpath("style.css").read_text(encoding="utf-8")
    said = [finding for each in made if each.evidence for finding in each.evidence.findings]
    counts = Counter(finding.verdict for finding in said)
    counts[FAILED] = sum(each.evidence is None for each in made)
    items = "".join(
        f"<li>{_badge(verdict)} {counts[verdict]}, {escape(meaning)}</li>"
        for verdict, meaning in MEANINGS.items()
        if counts[verdict]
    )
    seconds = sum(each.seconds for each in made)
    how = "quickly, with few runs and coarse grids" if quick else "in full"
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Sightfield: the thesis's figures and tables again</title>
<style>
{style}</style>
</head>
<body>
<main>
<h1>The figures and tables, made again</h1>
<p class="lead">M. Zhang, <cite>Path planning for autonomous vehicles</cite>, Iowa State University,
2014: its results as Sightfield makes them, beside what the thesis states of them in our words. Made
{how}. Below are the verdicts on {len(said)} statements, then the exhibits; one is said to differ
where any of its statements does.</p>
<ul class="counts">{items}</ul>
<nav aria-label="Contents">{"".join(map(_entry, made))}</nav>
{"".join(map(_section, made))}
<footer>Made in {_duration(seconds)} with {escape(made_with)}. What departs from print, and why:
docs/errata.md of the project.</footer>
</main>
</body>
</html>
"""


def _entry(made: Made) -> str:
    exhibit = made.exhibit
    return (
        f'<a href="#{exhibit.id}"><span class="covers">{_covers(exhibit.covers)}</span>'
        f"<span>{escape(exhibit.title)}</span>{_badge(made.verdict)}</a>"
    )


def _section(made: Made) -> str:
    exhibit = made.exhibit
    if made.evidence is None:
        body = f"<pre>{escape(made.error)}</pre>"
    else:
        body = _evidence(made.evidence, exhibit.title)
    return f"""<section id="{exhibit.id}">
<p class="covers">{_covers(exhibit.covers)}</p>
<header><h2><a href="#{exhibit.id}">{escape(exhibit.title)}</a></h2>{_badge(made.verdict)}</header>
<p class="states">{_text(exhibit.states)}</p>
{body}
<pre><code>{escape(exhibit.command)}</code></pre>
<p class="aside">Made in {_duration(made.seconds)}; again alone by
<code>sightfield reproduce --only {exhibit.id}</code></p>
</section>
"""


def _evidence(evidence: Evidence, title: str) -> str:
    pictures = "".join(_picture(each, title) for each in evidence.pictures)
    tables = "".join(map(_table, evidence.tables))
    return f"{pictures}{_findings(evidence.findings)}{tables}"


def _picture(picture: Picture, title: str) -> str:
    data = base64.b64encode(picture.file.read_bytes()).decode("ascii")
    alternative = escape(f"{title}: {picture.caption}")
    return (
        f'<figure><img alt="{alternative}" src="data:image/png;base64,{data}">'
        f"<figcaption>{_text(picture.caption)}</figcaption></figure>\n"
    )


def _findings(findings: Iterable[Finding]) -> str:
    rows = "".join(
        f"<tr><td>{_text(each.subject)}</td><td>{_text(each.thesis) or '-'}</td>"
        f"<td>{_text(each.ours)}</td><td>{_badge(each.verdict)}</td></tr>\n"
        for each in findings
    )
    head = "<tr><th></th><th>The thesis</th><th>Here</th><th></th></tr>"
    return (
        f'<div class="wide"><table class="findings"><thead>{head}</thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(each)}</th>" for each in table.head)
    rows = "".join(
        f"<tr>{''.join(f'<td>{_cell(each)}</td>' for each in row)}</tr>\n" for row in table.rows
    )
    return (
        f'<div class="wide"><table class="numbers"><caption>{_text(table.caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _cell(text: str) -> str:
    claim = _CLAIMS.get(text.removesuffix(" *"))
    if claim is not None:
        return f'<span class="{_class(claim)}">{escape(text)}</span>'
    return escape(text)


def _text(said: str) -> str:
    """Words in HTML, those between backticks as code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(said))


def _badge(verdict: str) -> str:
    meaning = escape(MEANINGS[verdict])
    return f'<span class="badge {_class(verdict)}" title="{meaning}">{escape(verdict)}</span>'


def _class(verdict: str) -> str:
    return verdict.replace(" ", "-")


def _covers(labels: Sequence[str]) -> str:
    """Labels, those of a kind together: "Figures 2.16, 2.17; Table 2.1"."""
    kinds: dict[str, list[str]] = {}
    for label in labels:
        kind, _, number = label.partition(" ")
        kinds.setdefault(kind, []).append(number)
    parts = [
        f"{kind}{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}"
        for kind, numbers in kinds.items()
    ]
    return escape("; ".join(parts)) or "Beyond the thesis"


def _duration(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds < 90 else f"{seconds / 60:.1f} min"

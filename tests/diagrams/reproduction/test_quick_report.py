"""The quick report holds every figure and table, and says what is known of them."""

import base64
import json
import re

import cv2
import numpy as np
import pytest

from sightfield.diagrams.reproduction.exhibits.evidence import AGREES, DIFFERS, SHOWN, VERDICTS
from sightfield.diagrams.reproduction.make_exhibits import EXHIBITS, FAILED
from sightfield.diagrams.studies.opponents import OPPONENTS
from sightfield.diagrams.tracking.scenario import OPTIMAL_POLICIES

FIGURES = {
    2: (5, 6, 10, 11, 12, 16, 17, 18, 19, 20, 34),
    3: (4, 5, 6, 8, 9, 10),
}
TABLES = {2: (1, 2, 3, 4), 3: (1,)}


def findings(report, exhibit):
    """Verdict by subject."""
    (found,) = [each for each in report.summary["exhibits"] if each["id"] == exhibit]
    return {each["subject"]: each["verdict"] for each in found["findings"]}


def test_every_figure_and_table_is_there(report):
    covered = [label for each in report.summary["exhibits"] for label in each["covers"]]
    wanted = [
        f"{kind} {chapter}.{number}"
        for kind, chapters in (("Figure", FIGURES), ("Table", TABLES))
        for chapter, numbers in chapters.items()
        for number in numbers
    ]
    assert sorted(covered) == sorted(wanted)
    assert report.exit_code == 0
    assert [each["error"] for each in report.summary["exhibits"]] == [None] * len(EXHIBITS)


def test_each_exhibit_has_a_section_with_its_verdict_and_command(report):
    for each in report.summary["exhibits"]:
        section = report.page.split(f'<section id="{each["id"]}">')[1].split("</section>")[0]
        assert f">{each['verdict']}</span>" in section
        assert each["command"].replace("'", "&#x27;") in section
        assert f'href="#{each["id"]}"' in report.page
        assert each["verdict"] in VERDICTS
        assert each["findings"]
        # Numbers that came to nothing have no place in a sentence.
        assert not [f for f in each["findings"] if re.search(r"\b(nan|inf)\b", f["ours"])]


def test_the_quick_report_compares_planners_in_few_directions(report):
    (found,) = [each for each in report.summary["exhibits"] if "Figure 3.10" in each["covers"]]
    (close,) = [each for each in found["findings"] if each["subject"].startswith("How close")]
    assert "at 5 of 5 ratios" in close["ours"]


def test_names_of_the_code_are_set_as_code(report):
    assert "<code>urgency</code>" in report.page
    assert "`" not in re.sub(r' alt="[^"]*"', "", report.page)


def test_the_page_needs_nothing_but_itself(report):
    links = re.findall(r'(?:src|href)="([^"]*)"', report.page)
    assert links
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in links)
    assert not re.search(r"url\(|@import|<script|<link", report.page)


def test_its_pictures_are_the_files_beside_it_and_not_empty(report):
    inside = [
        base64.b64decode(each)
        for each in re.findall(r"data:image/png;base64,([^\"]*)", report.page)
    ]
    files = {file.read_bytes() for file in (report.folder / "pictures").iterdir()}
    assert set(inside) == files
    for data in inside:
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        assert min(picture.shape[:2]) > 200
        assert picture.std() > 5


def test_the_summary_is_also_on_disk(report):
    text = (report.folder / "summary.json").read_text(encoding="utf-8")
    assert json.loads(text) == report.summary
    assert report.summary["quick"] is True


@pytest.mark.parametrize(
    ("exhibit", "subject", "verdict"),
    [
        ("table-2.1", "Who wins", AGREES),
        ("table-2.1", "How long sight holds in Region 1", AGREES),
        ("table-2.2", "States that the pursuer can win", DIFFERS),
        ("figure-2.5", "Three risk vectors, three fields", AGREES),
        ("figure-2.6", "One start, three tracks", AGREES),
        ("figure-2.10", "Error over distance (Figure 2.11, 2.2.5)", AGREES),
        ("figure-2.20", "Where the loops come to rest", DIFFERS),
        ("figure-2.34", "Parameters (Tables 2.3 and 2.4)", AGREES),
        ("figure-2.34", "All three at once", AGREES),
        ("figure-2.34", "At least one in any time instant", DIFFERS),
        ("figure-3.4", "The longest way between neighbours", AGREES),
        ("figure-3.5", "The longest way between neighbours", AGREES),
        ("figure-3.5", "The first round", AGREES),
        ("figure-3.6", "The longest way between neighbours", AGREES),
        ("figure-3.8", "Rows", AGREES),
        ("figure-3.8", "Order of the rows", AGREES),
        ("figure-3.9", "Refinement (Table 3.1)", AGREES),
        ("figure-3.9", "Both approaches reach the goal", AGREES),
        ("beyond-radio", "A centre less no radio at all, against adversarial", SHOWN),
        ("beyond-radio", "A centre less no radio at all, against best_response", SHOWN),
        ("beyond-landmarks", "Distance to a landmark's edge (2.14)", DIFFERS),
        ("beyond-solved-game", "Regret, one against one", SHOWN),
    ],
)
def test_what_does_not_hang_on_the_games_is_as_known(report, exhibit, subject, verdict):
    assert findings(report, exhibit)[subject] == verdict


@pytest.mark.parametrize("exhibit", ["figure-2.16", "figure-2.19"])
def test_every_claim_names_all_its_opponents(report, exhibit):
    (found,) = [each for each in report.summary["exhibits"] if each["id"] == exhibit]
    for finding in found["findings"]:
        assert ", the strongest of 4 (mean " in finding["ours"]
        for opponent in (*OPPONENTS, *OPTIMAL_POLICIES):
            assert f"against {opponent}" in finding["ours"]


@pytest.mark.parametrize("exhibit", ["beyond-risk-vectors", "beyond-aggregations", "beyond-radio"])
def test_what_is_beyond_the_thesis_is_shown_against_each_opponent(report, exhibit):
    said = " ".join(findings(report, exhibit))
    for opponent in OPPONENTS:
        assert f"against {opponent}" in said


def test_each_claim_is_judged_with_other_assumptions_too(report):
    section = report.page.split('<section id="figure-2.16">')[1].split("</section>")[0]
    table = section.split('<table class="numbers">')[1]
    head = re.findall(r"<th>([^<]*)</th>", table)
    assumptions = ("2 s", "2 obstacles", "8 obstacles", "robots of the testbed")
    wanted = {f"{each}, {opponent}" for each in assumptions for opponent in OPPONENTS}
    wanted |= {f"2 s, {opponent}" for opponent in OPTIMAL_POLICIES}
    assert set(head) == {"claim", "evaders that wander, random_walk"} | wanted
    # One opponent is the strongest wherever there are two.
    for row in table.split("<tr>")[2:]:
        assert row.count(" *</span>") == len(assumptions)
    assert table.count("<tr>") == 1 + len(findings(report, "figure-2.16"))
    assert FAILED not in table

"""The command: what it makes, what it refuses, and what it says of what goes wrong."""

import json

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands import reproduce as command
from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.reproduction.evidence import (
    AGREES,
    DIFFERS,
    SHOWN,
    UNDECIDED,
    Evidence,
    Exhibit,
    Finding,
    Table,
    Workshop,
)
from sightfield.diagrams.reproduction.make_exhibits import FAILED, Made, make_exhibits
from sightfield.diagrams.reproduction.page.make_page import make_page
from sightfield.diagrams.reproduction.registry import EXHIBITS, chosen_exhibits
from sightfield.systems.numerics.errors import InvalidInput

AWKWARD = "a < b & \"c\" <script>alert('d')</script>"


def finding(verdict):
    return Finding("subject", "thesis", "ours", verdict)


def exhibit(name, make):
    return Exhibit(name, (f"Figure {name}",), f"Title of {name}", "States.", "sightfield", make)


def fine(workshop):
    return Evidence((), (finding(AGREES),))


def broken(workshop):
    raise ZeroDivisionError("nothing to divide by")


@pytest.fixture
def run(monkeypatch):
    """A function that runs the command, errors coming through as exceptions."""

    def invoke(*words, exhibits=None):
        if exhibits is not None:
            monkeypatch.setattr(command, "chosen_exhibits", lambda wanted: exhibits)
        result = CliRunner().invoke(make_app(), ["reproduce", *map(str, words)])
        if isinstance(result.exception, Exception) and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return invoke


def test_a_single_figure(run, tmp_path):
    result = run("--quick", "--only", "figure-3.4", "--only", "figure-2.5", "--out", tmp_path)
    assert result.exit_code == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert [each["id"] for each in summary["exhibits"]] == ["figure-2.5", "figure-3.4"]
    assert sorted(file.name for file in (tmp_path / "pictures").iterdir()) == [
        "figure_2_5.png",
        "figure_3_4.png",
    ]
    assert "figure-2.6" not in (tmp_path / "report.html").read_text()


def test_a_failing_exhibit_is_told_and_the_others_are_made(run, tmp_path):
    exhibits = (exhibit("1", fine), exhibit("2", broken), exhibit("3", fine))
    result = run("--out", tmp_path, "--json", exhibits=exhibits)
    assert result.exit_code == 1
    summary = json.loads(result.stdout)
    assert [each["verdict"] for each in summary["exhibits"]] == [AGREES, FAILED, AGREES]
    assert summary["exhibits"][1]["error"] == "ZeroDivisionError: nothing to divide by"
    page = (tmp_path / "report.html").read_text()
    assert "ZeroDivisionError: nothing to divide by" in page
    assert "Title of 3" in page


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--only", "figure-9.9"), "`only` must be one of table-2.1, .*; got figure-9.9"),
        (("--runs", 1), "`runs` must be two at least; got 1"),
        (("--workers", -1), "`workers` must be zero or positive; got -1"),
        (("--world", "nowhere.wkt"), "nowhere.wkt"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_anything_is_made(run, tmp_path, words, message):
    out = tmp_path / "out"
    with pytest.raises(InvalidInput, match=message):
        run("--out", out, *words)
    assert not out.exists()


def test_exhibits_are_asked_for_by_any_figure_that_they_cover():
    assert [each.id for each in chosen_exhibits(["table-3.1", "figure-2.17"])] == [
        "figure-2.16",
        "figure-3.9",
    ]
    assert chosen_exhibits([]) == EXHIBITS


@pytest.mark.parametrize(
    ("verdicts", "whole"),
    [
        ([AGREES, SHOWN], AGREES),
        ([AGREES, UNDECIDED, SHOWN], UNDECIDED),
        ([AGREES, UNDECIDED, DIFFERS], DIFFERS),
        ([], SHOWN),
    ],
)
def test_the_weightiest_finding_is_the_exhibits(verdicts, whole):
    assert Evidence((), tuple(map(finding, verdicts))).verdict == whole


def test_a_verdict_that_is_none_is_refused():
    with pytest.raises(InvalidInput, match="`verdict` must be one of differs, cannot tell"):
        finding("perhaps")


def test_whatever_is_said_stays_text():
    awkward = Exhibit(
        "1",
        ("Figure 1", "Figure 2", "Table 3"),
        AWKWARD,
        AWKWARD,
        AWKWARD,
        lambda workshop: Evidence((), (), (Table(AWKWARD, (AWKWARD,), ((AWKWARD,), ("holds",))),)),
    )
    evidence = Evidence(
        (), (Finding(AWKWARD, AWKWARD, AWKWARD, DIFFERS),), awkward.make(None).tables
    )
    made = [Made(awkward, evidence, "", 1.0), Made(awkward, None, AWKWARD, 100.0)]
    page = make_page(made, quick=False, made_with=AWKWARD)
    assert "<script" not in page
    assert "Figures 1, 2; Table 3" in page
    assert '<td><span class="agrees">holds</span></td>' in page
    assert "Made in 1.7 min" in page


def test_each_exhibit_is_announced_before_it_is_made(tmp_path):
    order = []
    exhibits = [
        exhibit(str(k), lambda workshop: order.append("made") or fine(workshop)) for k in "12"
    ]
    make_exhibits(exhibits, Workshop(True, tmp_path, tmp_path), lambda each: order.append(each.id))
    assert order == ["1", "made", "2", "made"]


def test_as_many_runs_as_asked_for(tmp_path):
    assert Workshop(True, tmp_path, tmp_path).runs_of(1000, 8) == 8
    assert Workshop(False, tmp_path, tmp_path).runs_of(1000, 8) == 1000
    assert Workshop(False, tmp_path, tmp_path, runs=30).runs_of(1000, 8) == 30

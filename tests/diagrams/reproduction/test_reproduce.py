"""The command: what it makes, what it refuses, and what it says of what goes wrong."""

import errno
import json
import os

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands import reproduce as command
from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.outputs import NoRoom
from sightfield.diagrams.reproduction.exhibits import evidence
from sightfield.diagrams.reproduction.exhibits.evidence import (
    AGREES,
    DIFFERS,
    SHOWN,
    UNDECIDED,
    Evidence,
    Exhibit,
    Finding,
    Table,
    Workshop,
    fewest,
    findings_of,
    verdicts_by_assumption,
)
from sightfield.diagrams.reproduction.make_exhibits import (
    EXHIBITS,
    FAILED,
    Made,
    chosen_exhibits,
    make_exhibits,
)
from sightfield.diagrams.reproduction.page import make_page
from sightfield.diagrams.studies.claims import FAILS, HOLDS, ClaimVerdict, Judgement
from sightfield.diagrams.studies.team_studies import tracking_study
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


def crowded(workshop):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


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
    # The next report in the folder has fewer.
    run("--quick", "--only", "figure-3.4", "--out", tmp_path)
    assert [each.name for each in (tmp_path / "pictures").iterdir()] == ["figure_3_4.png"]


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
        (("--seconds", 0), "`seconds` must be positive and finite; got 0"),
        (("--seconds", "inf"), "`seconds` must be positive and finite; got inf"),
        (("--workers", -1), "`workers` must be zero or positive; got -1"),
        (("--world", "nowhere.wkt"), "nowhere.wkt"),
        (("--opponent-runs", "best_response"), "`opponent-runs` must have the form best_response"),
        (("--opponent-runs", "best_response=1"), "`opponent-runs` must be two at least; got 1"),
        (("--opponent-runs", "nobody=5"), "`opponent-runs` must be one of adversarial, best_re"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_anything_is_made(run, tmp_path, words, message):
    out = tmp_path / "out"
    with pytest.raises(InvalidInput, match=message):
        run("--out", out, *words)
    assert not out.exists()


def test_a_full_disk_ends_it_at_the_first_exhibit_that_meets_it(run, tmp_path):
    made = []
    exhibits = (exhibit("1", crowded), exhibit("2", lambda workshop: made.append(2)))
    with pytest.raises(NoRoom, match="`out` must have room for the results"):
        run("--out", tmp_path / "out", exhibits=exhibits)
    assert made == []
    assert list(tmp_path.iterdir()) == []


def test_exhibits_are_asked_for_by_any_figure_that_they_cover():
    assert [each.id for each in chosen_exhibits(["table-3.1", "figure-2.17"])] == [
        "figure-2.16",
        "figure-3.9",
    ]
    assert chosen_exhibits([]) == EXHIBITS
    beyond = chosen_exhibits(["beyond"])
    assert "beyond-solved-game" in {each.id for each in beyond}
    assert beyond == tuple(each for each in EXHIBITS if each.id.startswith("beyond-"))


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
        lambda workshop: Evidence(
            (), (), (Table(AWKWARD, (AWKWARD,), ((AWKWARD,), ("holds *",))),)
        ),
    )
    evidence = Evidence(
        (), (Finding(AWKWARD, AWKWARD, AWKWARD, DIFFERS),), awkward.make(None).tables
    )
    made = [Made(awkward, evidence, "", 1.0), Made(awkward, None, AWKWARD, 100.0)]
    page = make_page(made, quick=False, made_with=AWKWARD)
    assert "<script" not in page
    assert "Figures 1, 2; Table 3" in page
    assert '<td><span class="agrees">holds *</span></td>' in page
    assert "Made in 1.7 min" in page


def test_each_exhibit_is_announced_before_it_is_made(tmp_path):
    order = []
    exhibits = [
        exhibit(str(k), lambda workshop: order.append("made") or fine(workshop)) for k in "12"
    ]
    make_exhibits(exhibits, Workshop(True, tmp_path, tmp_path), lambda each: order.append(each.id))
    assert order == ["1", "made", "2", "made"]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"quick": True}, (8, 2)),
        ({"quick": False}, (1000, 100)),
        ({"quick": False, "runs": 30}, (30, 30)),
        # Those that are slow to play are never more than usual, unless they are asked for.
        ({"quick": False, "runs": 3000}, (3000, 100)),
        ({"quick": True, "opponent_runs": {"best_response": 5}}, (8, 5)),
        ({"quick": False, "runs": 30, "opponent_runs": {"best_response": 300}}, (30, 300)),
    ],
)
def test_as_many_runs_as_asked_for(tmp_path, options, expected):
    workshop = Workshop(pictures=tmp_path, studies=tmp_path, **options)
    found = workshop.runs_against(
        {"adversarial": 1000, "best_response": 100}, {"adversarial": 8, "best_response": 2}
    )
    assert found == dict(zip(("adversarial", "best_response"), expected, strict=True))


def test_variants_have_no_more_runs_than_the_study_itself():
    most = {"adversarial": 60, "best_response": 20, "random_walk": 60}
    assert fewest({"adversarial": 1000, "best_response": 100}, most) == most
    few = {"adversarial": 5, "best_response": 2}
    assert fewest(few, most) == {**few, "random_walk": 5}


@pytest.mark.parametrize(("asked", "longest"), [(None, 120.0), (7.0, 7.0), (500.0, 120.0)])
def test_games_last_no_longer_than_asked_for(monkeypatch, tmp_path, asked, longest):
    monkeypatch.setattr(evidence, "run_study", lambda study, *where, **how: study)
    workshop = Workshop(quick=True, pictures=tmp_path, studies=tmp_path, seconds=asked)
    assert evidence.played(workshop, tracking_study(runs=2)).base.seconds == longest


def verdict(claim, opponent, level, found):
    return ClaimVerdict(claim, "2.16", "The thesis says.", opponent, level, found, "Numbers.")


def test_a_finding_is_what_the_strongest_opponent_leaves_of_a_claim():
    both = Judgement((verdict("a", "weak", 9.0, HOLDS), verdict("a", "strong", 3.0, FAILS)))
    alone = Judgement((verdict("a", "wandering", 50.0, HOLDS),))
    (found,) = findings_of([both])
    assert (found.subject, found.thesis, found.verdict) == ("a", "The thesis says.", DIFFERS)
    assert found.ours == (
        "Does not hold, against strong, the strongest of 2 (mean 3.0 s): Numbers. "
        "Holds, against weak (mean 9.0 s): Numbers."
    )
    (found,) = findings_of([alone])
    assert found.verdict == AGREES
    assert found.ours == "Holds, against wandering alone (mean 50.0 s): Numbers."
    table = verdicts_by_assumption({"120 s": (both,), "others": (alone,)})
    assert table.head == ("claim", "120 s, weak", "120 s, strong", "others, wandering")
    assert table.rows == (("a", "holds", "does not hold *", "holds"),)

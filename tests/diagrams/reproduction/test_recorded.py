"""Exhibits that are soon made, and all that the quick report says, are as they were recorded."""

import re

import pytest

from sightfield.diagrams.reproduction.exhibits.evidence import Workshop
from sightfield.diagrams.reproduction.make_exhibits import chosen_exhibits

# Rounding errors, and zeros with a sign.
NOISE = ((r"\d(\.\d+)?e-\d\d", "0"), (r"-(0\.0+)(?!\d)", r"+\1"))


def without_noise(text: str) -> str:
    for pattern, plain in NOISE:
        text = re.sub(pattern, plain, text)
    return text


@pytest.mark.parametrize(
    "name",
    ["table-2.1", "figure-2.5", "figure-2.6", "figure-2.20", "figure-3.4", "figure-3.6"],
)
def test_an_exhibit_is_as_recorded(name, tmp_path, drawn, as_recorded, saved_pictures):
    (exhibit,) = chosen_exhibits([name])
    evidence = exhibit.make(Workshop(quick=True, pictures=tmp_path, studies=tmp_path / "studies"))
    as_recorded([(each.subject, without_noise(each.ours)) for each in evidence.findings], "says")
    as_recorded([(each.file, each.caption) for each in evidence.pictures], "captions")
    pictures = {name: drawn(each) for name, each in saved_pictures.items()}
    as_recorded(pictures, "pictures", relative=1e-5)


def test_the_runs_of_a_short_report_are_as_recorded(tmp_path, drawn, as_recorded, saved_pictures):
    (exhibit,) = chosen_exhibits(["beyond-risk-vectors"])
    folders = {"pictures": tmp_path, "studies": tmp_path / "studies"}
    evidence = exhibit.make(Workshop(quick=True, **folders, runs=3, seconds=1.5))
    as_recorded([without_noise(each.ours) for each in evidence.findings], "says")
    as_recorded(evidence.tables, "tables")
    as_recorded({name: drawn(each) for name, each in saved_pictures.items()}, "pictures")


def test_the_page_of_the_quick_report_is_as_recorded(report, as_recorded):
    page = re.sub(r'data:image/png;base64,[^"]*', "", report.page.partition("</style>")[2])
    page = re.sub(r"[Mm]ade in .*", "", page)
    as_recorded(without_noise(page).splitlines())

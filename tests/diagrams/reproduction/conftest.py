"""The quick report, made once for all tests that look at it."""

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app


@dataclass(frozen=True)
class Report:
    """What the command left."""

    folder: Path
    exit_code: int
    page: str
    summary: dict


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """`sightfield reproduce --quick`, in this process."""
    folder = tmp_path_factory.mktemp("reproduction")
    words = ["reproduce", "--quick", "--workers", "0", "--json", "--out", str(folder)]
    result = CliRunner().invoke(make_app(), words)
    page = (folder / "report.html").read_text(encoding="utf-8")
    return Report(folder, result.exit_code, page, json.loads(result.stdout))

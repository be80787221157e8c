"""What tests of several commands need."""

import sys
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from sightfield.diagrams.commands.app import main


@pytest.fixture
def sightfield_here(monkeypatch, capsys) -> Callable[..., SimpleNamespace]:
    """A function that runs `sightfield` with words as its program does, in this process.

    What it gives has the names of a finished process: returncode, stdout, stderr.
    """

    def run(*words: object) -> SimpleNamespace:
        monkeypatch.setattr(sys, "argv", ["sightfield", *map(str, words)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return SimpleNamespace(returncode=ended.value.code or 0, stdout=said.out, stderr=said.err)

    return run

"""A missing program skips its tests with the line to type, and fails them where CI=true."""

import pytest


@pytest.fixture
def nothing_installed(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    return monkeypatch


@pytest.mark.parametrize(("ci", "outcome"), [("", pytest.skip), ("true", pytest.fail)])
def test_a_missing_program_is_named_with_its_package(nothing_installed, require_tool, ci, outcome):
    nothing_installed.setenv("CI", ci)
    with pytest.raises(outcome.Exception, match="dot is not installed: sudo apt-get install gr"):
        require_tool("dot", "graphviz")


@pytest.mark.parametrize("name", ["chromium", "google-chrome"])
def test_a_program_is_found_under_each_of_its_names(
    nothing_installed, require_tool, tmp_path, name
):
    program = tmp_path / name
    program.touch(mode=0o755)
    assert require_tool("chromium", "chromium", "google-chrome") == str(program)

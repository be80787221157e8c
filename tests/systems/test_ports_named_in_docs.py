"""Ports that the documentation names, as {port}`AgentTeam.velocity`, are those of systems."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
NAMED = sorted(
    {
        name
        for file in DOCS.rglob("*.md")
        for name in re.findall(r"\{port\}`([^`]+)`", file.read_text(encoding="utf-8"))
    }
)


def test_the_pages_name_ports():
    assert len(NAMED) > 20


@pytest.mark.parametrize("name", NAMED)
def test_a_system_has_the_port(name, system_examples):
    system, _, port = name.rpartition(".")
    example = system_examples[system]()
    assert example.HasInputPort(port) or example.HasOutputPort(port)

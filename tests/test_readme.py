"""What the README says can be typed, can be typed."""

import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
SCRIPTS = [
    [line.split("#")[0].strip() for line in block.strip().split("\n")]
    for kind, block in BLOCKS
    if kind == "sh"
]
COMMANDS = [script for script in SCRIPTS if script[0].startswith("sightfield")]
PROGRAM = Path(sys.executable).with_name("sightfield")
# What runs until Ctrl-C, while what follows it is typed in another terminal.
SERVES = ("social", "server")
MAP = "POLYGON ((0 0, 9 0, 9 7, 0 7, 0 0), (3 3, 5 3, 5 5, 3 5, 3 3))"


def test_there_are_commands():
    assert len(COMMANDS) >= 5


@contextmanager
def serving(words: list[str]) -> Iterator[None]:
    """A command that serves, from when it says that another terminal may go on to Ctrl-C."""
    started = [str(PROGRAM), *words]
    with subprocess.Popen(started, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            assert any("In another terminal" in line for line in server.stdout)
            yield
        finally:
            server.send_signal(signal.SIGINT)
            server.communicate(timeout=60)
        assert server.returncode == 0


@pytest.mark.parametrize("script", COMMANDS, ids=lambda script: script[0])
def test_commands_run_one_after_the_other(
    script, begun, sightfield_here, run_program, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    Path("map.wkt").write_text(MAP)
    with ExitStack() as servers:
        for line in script:
            program, *words = shlex.split(line.replace("map.yaml", "map.wkt"))
            assert program == "sightfield"
            if tuple(words) == SERVES:
                servers.enter_context(serving(words))
                continue
            if words[0] == "station":
                # It looks for keys, and the input of tests is no file.
                run_program(PROGRAM, *begun(words))
                continue
            done = sightfield_here(*begun(words))
            assert done.returncode == 0, done.stderr


def test_make_targets_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    lines = [line for script in SCRIPTS for line in script]
    targets = [line.split()[1] for line in lines if line.startswith("make ")]
    assert targets
    assert all(re.search(rf"^{target}:", makefile, re.MULTILINE) for target in targets)


def test_the_diagram_of_ones_own_runs(tmp_path):
    ((_, code),) = [block for block in BLOCKS if block[0] == "python"]
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"sight lost at \d+\.\d\d s\n", done.stdout)


def test_pictures_and_links_exist():
    links = re.findall(r"\]\(([^)#]+)\)", README)
    local = [link for link in links if not link.startswith("http")]
    assert local
    missing = [link for link in local if not (ROOT / link).exists()]
    assert not missing

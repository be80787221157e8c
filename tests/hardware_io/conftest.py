"""The robots' firmware: emulated in simavr, and its portable files compiled for this machine."""

import ctypes
import os
import subprocess
from pathlib import Path

import pytest

from sightfield.hardware_io.emulation.robot_cores import (
    FIRMWARE,
    MissingTool,
    firmware_path,
    runner_path,
)


@pytest.fixture(scope="session")
def emulator() -> None:
    """What emulated robots need; without it a test is skipped, and fails where CI=true."""
    try:
        firmware_path()
        runner_path()
    except MissingTool as missing:
        if os.environ.get("CI") == "true":
            pytest.fail(str(missing))
        pytest.skip(str(missing))


@pytest.fixture(scope="session")
def compile_firmware(require_tool, tmp_path_factory):
    """A function that compiles the portable files with more arguments; returns the product."""
    cc = require_tool("cc", "gcc libc6-dev", "gcc", "clang")

    def compile_with(name: str, *arguments: str | Path) -> Path:
        product = tmp_path_factory.mktemp("firmware") / name
        sources = sorted((FIRMWARE / "portable").glob("*.c"))
        warnings = ["-std=c99", "-Wall", "-Wextra", "-Werror"]
        command = [cc, *warnings, f"-I{FIRMWARE}", "-o", product, *sources, *arguments]
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return product

    return compile_with


@pytest.fixture(scope="session")
def firmware_library(compile_firmware) -> ctypes.CDLL:
    """The portable files as a shared library."""
    return ctypes.CDLL(str(compile_firmware("firmware.so", "-O2", "-shared", "-fPIC")))


class Pauses:
    """A condition whose waiting lets a clock go on; it notes for how long, to some digits."""

    def __init__(self, clock, digits=6):
        self.clock, self.digits, self.pauses = clock, digits, []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Nobody else is there."""

    def notify_all(self):
        """Nobody waits."""

    def wait_for(self, predicate, patience):
        self.pauses.append(round(patience, self.digits))
        self.clock.now += patience
        return predicate()


@pytest.fixture
def pauses_of():
    """A function of a clock, whose time is `now`: a condition that waits by it."""
    return Pauses

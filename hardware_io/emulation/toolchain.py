"""Builds the robots' firmware and the emulator's runner, once for each state of their sources."""

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from ...diagrams.outputs import cache_folder
from ...systems.numerics.errors import SightfieldError

FIRMWARE = Path(__file__).resolve().parents[1] / "firmware"
RUNNER = Path(__file__).resolve().parent
RUNNER_SOURCES = ("runner.c", "board.c", "wheels_model.c")

# What a build needs, and the Debian packages that have it.
_PACKAGES = {
    "avr-gcc": "gcc-avr avr-libc",
    "make": "make",
    "cc": "gcc libc6-dev",
    "libsimavr": "libsimavr-dev",
}


class ToolchainError(SightfieldError):
    """The firmware or the runner cannot be built; the message says what is wrong."""


class MissingTool(ToolchainError):
    """A program or library is not installed; the message says what to type."""


def firmware_path() -> Path:
    """The robots' program, robot.elf, built if need be.

    Raises:
        MissingTool: avr-gcc or make is not installed.
        ToolchainError: They refuse.
    """
    return _built(FIRMWARE, "robot.elf", ["make", "--silent", "OUT={out}"], ("avr-gcc", "make"))


def runner_path() -> Path:
    """The program that runs firmware in simavr, built if need be.

    Raises:
        MissingTool: A compiler or libsimavr is not installed.
        ToolchainError: The compiler refuses.
    """
    command = ["cc", "-O2", "-Wall", "-Wextra", "-Werror", "-o", "{out}/runner"]
    command += [*RUNNER_SOURCES, "-lsimavr", "-lm"]
    return _built(RUNNER, "runner", command, ("cc", "libsimavr"))


def _has(tool: str) -> bool:
    if tool != "libsimavr":
        return shutil.which(tool) is not None
    probe = ["cc", "-fsyntax-only", "-xc", "-"]
    done = subprocess.run(probe, input=b"#include <simavr/sim_avr.h>\n", capture_output=True)
    return done.returncode == 0


def _built(sources: Path, name: str, command: list[str], tools: tuple[str, ...]) -> Path:
    """Path of a product in the cache, under the digest of the sources it is made from."""
    digest = hashlib.sha256(repr(command).encode())
    for file in sorted(sources.rglob("*")):
        if file.suffix in (".c", ".h") or file.name == "Makefile":
            digest.update(file.relative_to(sources).as_posix().encode() + b"\0" + file.read_bytes())
    product = cache_folder() / digest.hexdigest()[:16] / name
    if product.is_file():
        return product
    for tool in tools:
        if not _has(tool):
            packages = _PACKAGES[tool]
            raise MissingTool(f"{tool} is not installed: sudo apt-get install {packages}")
    product.parent.mkdir(parents=True, exist_ok=True)
    # Built aside and moved: two processes may build at once.
    with tempfile.TemporaryDirectory(dir=product.parent) as folder:
        words = [word.format(out=folder) for word in command]
        done = subprocess.run(
            words, cwd=sources, capture_output=True, text=True, stdin=subprocess.DEVNULL
        )
        if done.returncode != 0:
            said = done.stderr.strip().splitlines()
            reasons = [line for line in said if "error" in line] or said or ["no reason given"]
            raise ToolchainError(f"{name} cannot be built: {reasons[0]}")
        os.replace(Path(folder) / name, product)
    return product

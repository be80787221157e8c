"""Builds the robots' firmware and the emulator's runner, once for each state of their sources."""

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from ...systems.numerics.errors import SightfieldError

FIRMWARE = Path(__file__).resolve().parents[1] / "firmware"
RUNNER = Path(__file__).resolve().parent
RUNNER_SOURCES = ("runner.c", "board.c", "wheels_model.c")

# Program, and the Debian package that has it.
TOOLS = {"avr-gcc": "gcc-avr avr-libc", "make": "make", "cc": "gcc libc6-dev libsimavr-dev"}


class ToolchainError(SightfieldError):
    """The firmware or the runner cannot be built; the message says what is missing or wrong."""


def firmware_path() -> Path:
    """The robots' program, robot.elf, built if need be.

    Raises:
        ToolchainError: avr-gcc is missing or refuses.
    """
    return _built(FIRMWARE, "robot.elf", ["make"], ("avr-gcc", "make"))


def runner_path() -> Path:
    """The program that runs firmware in simavr, built if need be.

    Raises:
        ToolchainError: A compiler or libsimavr is missing.
    """
    command = ["cc", "-O2", "-Wall", "-Wextra", "-Werror", "-o"]
    command += ["{out}/runner", *RUNNER_SOURCES, "-lsimavr", "-lm"]
    return _built(RUNNER, "runner", command, ("cc",))


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "sightfield"


def _built(sources: Path, name: str, command: list[str], tools: tuple[str, ...]) -> Path:
    """Path of a product in the cache, under the digest of the sources it is made from."""
    digest = hashlib.sha256(repr(command).encode())
    for file in sorted(sources.iterdir()):
        if file.suffix in (".c", ".h") or file.name == "Makefile":
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
    product = _cache() / digest.hexdigest()[:16] / name
    if product.is_file():
        return product
    for tool in tools:
        if shutil.which(tool) is None:
            raise ToolchainError(
                f"{tool} is not installed: sudo apt-get install {TOOLS[tool]}",
            )
    product.parent.mkdir(parents=True, exist_ok=True)
    # Built aside and moved: two processes may build at once.
    with tempfile.TemporaryDirectory(dir=product.parent) as folder:
        words = [word.format(out=folder) for word in command]
        if words == ["make"]:
            words += ["--silent", f"OUT={folder}"]
        done = subprocess.run(
            words, cwd=sources, capture_output=True, text=True, stdin=subprocess.DEVNULL
        )
        if done.returncode != 0:
            reason = (done.stderr or done.stdout).strip().splitlines()[:1]
            raise ToolchainError(f"{name} cannot be built: {' '.join(reason)}")
        os.replace(Path(folder) / name, product)
    return product

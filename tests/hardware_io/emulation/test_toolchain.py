"""Firmware and runner are built once, and what is missing is named with its package."""

import shutil

import pytest

from sightfield.hardware_io.emulation import toolchain
from sightfield.hardware_io.emulation.toolchain import (
    MissingTool,
    ToolchainError,
    firmware_path,
    runner_path,
)


def test_without_a_compiler_the_line_to_type_is_said(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingTool, match="avr-gcc is not installed: sudo apt-get install gcc-avr"):
        firmware_path()
    with pytest.raises(MissingTool, match="cc is not installed: sudo apt-get install gcc"):
        runner_path()


@pytest.mark.usefixtures("emulator")
def test_a_build_is_kept_until_its_sources_change(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    first = firmware_path()
    made = first.stat().st_mtime_ns
    assert firmware_path() == first
    assert first.stat().st_mtime_ns == made

    changed = tmp_path / "firmware"
    shutil.copytree(toolchain.FIRMWARE, changed)
    monkeypatch.setattr(toolchain, "FIRMWARE", changed)
    robot = (changed / "robot.h").read_text()
    (changed / "robot.h").write_text(robot.replace("170U", "160U"))
    assert firmware_path() != first

    (changed / "main.c").write_text("int main(void) { return nothing; }\n")
    with pytest.raises(ToolchainError, match=r"robot.elf cannot be built: main\.c"):
        firmware_path()

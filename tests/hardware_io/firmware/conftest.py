"""Structures of the firmware as ctypes has them."""

import ctypes

import pytest


class CEntry(ctypes.Structure):
    """struct frame_entry of portable/frames.h."""

    _fields_ = (("robot", ctypes.c_uint8), ("first", ctypes.c_int16), ("second", ctypes.c_int16))


class CFrame(ctypes.Structure):
    """struct frame of portable/frames.h."""

    _fields_ = (
        ("kind", ctypes.c_uint8),
        ("session", ctypes.c_uint16),
        ("sequence", ctypes.c_uint16),
        ("robot", ctypes.c_uint8),
        ("form", ctypes.c_uint8),
        ("count", ctypes.c_uint8),
        ("age", ctypes.c_uint16),
        ("entries", CEntry * 16),
    )


@pytest.fixture(scope="session")
def c_frame() -> type[CFrame]:
    """struct frame of portable/frames.h."""
    return CFrame

"""What is taken for a picture, and what is not."""

import struct
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.landmark_pictures import landmark_picture
from sightfield.systems.numerics.social.recognition.picture_files import (
    LARGEST,
    decode_picture,
    encode_picture,
)

PICTURE = landmark_picture(2)
SIZE = PICTURE.shape[1], PICTURE.shape[0]
JPEG = encode_picture(PICTURE)
PNG = cv2.imencode(".png", PICTURE[..., ::-1])[1].tobytes()


def png_that_claims(width: int, height: int, pixels: bytes = zlib.compress(bytes(64))) -> bytes:
    """A file of few bytes that says it is large."""
    header = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [header, b"IDAT" + pixels, b"IEND"]
    packed = (struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)


def test_a_picture_survives_being_posted():
    decoded = decode_picture(JPEG, *SIZE)
    assert np.abs(decoded.astype(int) - PICTURE).mean() < 4


def test_a_png_is_read_as_it_is():
    assert np.array_equal(decode_picture(PNG, *SIZE), PICTURE)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "be a whole PNG or JPEG file; got 0 bytes"),
        (b"\xff\xd8 hello \xff\xd9", "be a whole PNG or JPEG file"),
        (JPEG[: len(JPEG) // 2], "be a whole PNG or JPEG file"),
        (PNG[: len(PNG) // 2], "be a whole PNG or JPEG file"),
        (png_that_claims(60000, 60000), "be 256 x 256 pixels; got 60000 x 60000"),
        (png_that_claims(256, 256)[:-20] + b"IEND", "be a whole PNG or JPEG file"),
        (png_that_claims(256, 256, b"no pixels"), "decode to 8-bit colours"),
        (bytes(LARGEST + 1), "have at most"),
        (encode_picture(PICTURE[:100]), "be 256 x 256 pixels; got 256 x 100"),
    ],
)
def test_other_bytes_are_refused(data, message):
    with pytest.raises(InvalidInput, match=message):
        decode_picture(data, *SIZE)


@given(st.binary(max_size=200), st.sampled_from([b"", JPEG[:200], PNG[:60]]))
def test_random_bytes_never_do_more_than_be_refused(data, start):
    with pytest.raises(InvalidInput):
        decode_picture(start + data, *SIZE)


@given(st.integers(0, len(JPEG) - 1), st.integers(0, 255))
def test_a_damaged_file_gives_a_picture_or_is_refused(place, value):
    damaged = JPEG[:place] + bytes([value]) + JPEG[place + 1 :]
    try:
        decoded = decode_picture(damaged, *SIZE)
    except InvalidInput:
        return
    assert decoded.shape == PICTURE.shape

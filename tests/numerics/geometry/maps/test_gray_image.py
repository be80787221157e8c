"""A picture is read whole or refused."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.maps.gray_image import read_gray_image

PIXELS = np.array([[0, 205, 254], [7, 35, 10]], dtype=np.uint8)
P5 = b"P5\n3 2\n255\n" + PIXELS.tobytes()
P2 = b"P2\n3 2\n255\n0 205 254\n7 35 10\n"
PNG = bytes(cv2.imencode(".png", PIXELS)[1])


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """A function that reads bytes as a picture file."""
    path = tmp_path_factory.mktemp("pictures") / "picture"

    def read_bytes(data):
        path.write_bytes(data)
        return read_gray_image(path)

    return read_bytes


@pytest.mark.parametrize("data", [P5, P2, PNG], ids=["binary PGM", "plain PGM", "PNG"])
def test_the_formats_agree(read, data):
    image = read(data)
    np.testing.assert_array_equal(image.channels[:, :, 0], PIXELS)
    assert (image.white, image.alpha) == (255, None)


def test_comments_may_stand_anywhere_in_a_header(read):
    # A pixel of value 35 is a '#', which starts no comment among binary pixels.
    image = read(b"P5 # made by hand\n#\n3 # columns\n#rows\n2\r\n255\n" + PIXELS.tobytes())
    np.testing.assert_array_equal(image.channels[:, :, 0], PIXELS)


def test_a_pixel_that_looks_like_white_space_is_a_pixel(read):
    image = read(b"P5 2 1 255 " + b"\n ")
    assert image.channels.ravel().tolist() == [10, 32]


def test_sixteen_bits_are_big_endian_in_a_pgm(read):
    image = read(b"P5 2 1 1000\n" + bytes([1, 0, 3, 232]))
    assert (image.channels.ravel().tolist(), image.white) == ([256, 1000], 1000)


def test_sixteen_bit_png_files_keep_their_depth(read):
    image = read(bytes(cv2.imencode(".png", np.array([[256, 65535]], dtype=np.uint16))[1]))
    assert (image.channels.ravel().tolist(), image.white) == ([256, 65535], 65535)


def test_alpha_is_kept_apart(read):
    image = read(bytes(cv2.imencode(".png", np.array([[[1, 2, 3, 4]]], dtype=np.uint8))[1]))
    assert sorted(image.channels.ravel().tolist()) == [1, 2, 3]
    assert image.alpha is not None
    assert image.alpha.ravel().tolist() == [4]


@given(
    pixels=arrays(np.uint8, st.tuples(st.integers(1, 6), st.integers(1, 6))),
    gap=st.sampled_from([b" ", b"\n", b"\t#x\n", b"\n# 1 2 3\r\n  "]),
)
def test_any_picture_survives_both_kinds_of_pgm(read, pixels, gap):
    rows, columns = pixels.shape
    header = gap.join([b"", b"%d" % columns, b"%d" % rows, b"255\n"])
    np.testing.assert_array_equal(read(b"P5" + header + pixels.tobytes()).channels[:, :, 0], pixels)
    plain = gap.join(b"%d" % value for value in pixels.ravel())
    np.testing.assert_array_equal(read(b"P2" + header + plain).channels[:, :, 0], pixels)


@pytest.mark.parametrize("data", [P5, PNG], ids=["binary PGM", "PNG"])
def test_no_beginning_of_a_picture_passes_for_a_picture(read, data):
    for length in range(len(data)):
        with pytest.raises(InvalidInput, match="`image` must"):
            read(data[:length])


def test_a_plain_pgm_with_a_pixel_missing_is_refused(read):
    with pytest.raises(InvalidInput, match=r"3 x 2 pixels.*got 5 instead of 6"):
        read(P2.removesuffix(b"10\n"))


def test_too_many_pixels_are_refused_but_a_last_line_end_is_not(read):
    read(P5 + b"\n")
    with pytest.raises(InvalidInput, match="got 7 instead of 6"):
        read(P5 + b"a")


def test_damaged_pixels_are_refused(read):
    position = PNG.index(b"IDAT") + 8
    with pytest.raises(InvalidInput, match="damaged b'IDAT' chunk"):
        read(PNG[:position] + bytes([PNG[position] ^ 1]) + PNG[position + 1 :])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "an empty file"),
        (b"GIF89a", "PGM or PNG"),
        (b"P5 3 x 255\n", "PGM header"),
        (b"P5 0 2 255\n", "have pixels; got 0 x 2"),
        (b"P5 1 1 0\n\0", "maxval in 1..65535; got 0"),
        (b"P5 1 1 65536\n\0\0", "maxval in 1..65535; got 65536"),
        (b"P5 1 1 9\n\x0a", "within its maxval 9"),
        (b"P2 1 1 9\n-1", "decimal pixels"),
        (b"P5 999999999 999999999 255\n", "instead of 999999998000000001"),
    ],
)
def test_what_is_wrong_is_said(read, data, message):
    with pytest.raises(InvalidInput, match=message):
        read(data)


@given(rest=st.binary(max_size=40), start=st.sampled_from([b"P5", b"P2", b"P2 2 1 9\n", PNG[:40]]))
def test_rubbish_is_refused_and_nothing_worse(read, start, rest):
    try:
        image = read(start + rest)
    except InvalidInput:
        return
    assert image.channels.min() >= 0
    assert image.channels.max() <= image.white


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"`image` must be a readable file; got .*nowhere\.pgm"):
        read_gray_image(tmp_path / "nowhere.pgm")

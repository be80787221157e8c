"""A ROS map is what map_server makes of it; its picture is read whole or refused."""

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.occupancy_map import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyMap,
    read_gray_image,
    read_occupancy_map,
)

PIXELS = np.array([[0, 205, 254], [7, 35, 10]], dtype=np.uint8)
P5 = b"P5\n3 2\n255\n" + PIXELS.tobytes()
P2 = b"P2\n3 2\n255\n0 205 254\n7 35 10\n"
PNG = bytes(cv2.imencode(".png", PIXELS)[1])


@pytest.fixture(scope="module")
def read_picture(tmp_path_factory):
    """A function that reads bytes as a picture file."""
    path = tmp_path_factory.mktemp("pictures") / "picture"

    def read_bytes(data):
        path.write_bytes(data)
        return read_gray_image(path)

    return read_bytes


@pytest.mark.parametrize("data", [P5, P2, PNG], ids=["binary PGM", "plain PGM", "PNG"])
def test_the_formats_agree(read_picture, data):
    image = read_picture(data)
    np.testing.assert_array_equal(image.channels[:, :, 0], PIXELS)
    assert (image.white, image.alpha) == (255, None)


def test_comments_may_stand_anywhere_in_a_header(read_picture):
    # A pixel of value 35 is a '#', which starts no comment among binary pixels.
    image = read_picture(b"P5 # made by hand\n#\n3 # columns\n#rows\n2\r\n255\n" + PIXELS.tobytes())
    np.testing.assert_array_equal(image.channels[:, :, 0], PIXELS)


def test_a_pixel_that_looks_like_white_space_is_a_pixel(read_picture):
    image = read_picture(b"P5 2 1 255 " + b"\n ")
    assert image.channels.ravel().tolist() == [10, 32]


def test_sixteen_bits_are_big_endian_in_a_pgm(read_picture):
    image = read_picture(b"P5 2 1 1000\n" + bytes([1, 0, 3, 232]))
    assert (image.channels.ravel().tolist(), image.white) == ([256, 1000], 1000)


def test_sixteen_bit_png_files_keep_their_depth(read_picture):
    image = read_picture(bytes(cv2.imencode(".png", np.array([[256, 65535]], dtype=np.uint16))[1]))
    assert (image.channels.ravel().tolist(), image.white) == ([256, 65535], 65535)


def test_alpha_is_kept_apart(read_picture):
    image = read_picture(bytes(cv2.imencode(".png", np.array([[[1, 2, 3, 4]]], dtype=np.uint8))[1]))
    assert sorted(image.channels.ravel().tolist()) == [1, 2, 3]
    assert image.alpha is not None
    assert image.alpha.ravel().tolist() == [4]


@given(
    pixels=arrays(np.uint8, st.tuples(st.integers(1, 6), st.integers(1, 6))),
    gap=st.sampled_from([b" ", b"\n", b"\t#x\n", b"\n# 1 2 3\r\n  "]),
)
def test_any_picture_survives_both_kinds_of_pgm(read_picture, pixels, gap):
    rows, columns = pixels.shape
    header = gap.join([b"", b"%d" % columns, b"%d" % rows, b"255\n"])
    np.testing.assert_array_equal(
        read_picture(b"P5" + header + pixels.tobytes()).channels[:, :, 0], pixels
    )
    plain = gap.join(b"%d" % value for value in pixels.ravel())
    np.testing.assert_array_equal(read_picture(b"P2" + header + plain).channels[:, :, 0], pixels)


@pytest.mark.parametrize("data", [P5, PNG], ids=["binary PGM", "PNG"])
def test_no_beginning_of_a_picture_passes_for_a_picture(read_picture, data):
    for length in range(len(data)):
        with pytest.raises(InvalidInput, match="`image` must"):
            read_picture(data[:length])


def test_a_plain_pgm_with_a_pixel_missing_is_refused(read_picture):
    with pytest.raises(InvalidInput, match=r"3 x 2 pixels.*got 5 instead of 6"):
        read_picture(P2.removesuffix(b"10\n"))


def test_too_many_pixels_are_refused_but_a_last_line_end_is_not(read_picture):
    read_picture(P5 + b"\n")
    with pytest.raises(InvalidInput, match="got 7 instead of 6"):
        read_picture(P5 + b"a")


def test_damaged_pixels_are_refused(read_picture):
    position = PNG.index(b"IDAT") + 8
    with pytest.raises(InvalidInput, match="damaged b'IDAT' chunk"):
        read_picture(PNG[:position] + bytes([PNG[position] ^ 1]) + PNG[position + 1 :])


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
def test_what_is_wrong_is_said(read_picture, data, message):
    with pytest.raises(InvalidInput, match=message):
        read_picture(data)


@given(rest=st.binary(max_size=40), start=st.sampled_from([b"P5", b"P2", b"P2 2 1 9\n", PNG[:40]]))
def test_rubbish_is_refused_and_nothing_worse(read_picture, start, rest):
    try:
        image = read_picture(start + rest)
    except InvalidInput:
        return
    assert image.channels.min() >= 0
    assert image.channels.max() <= image.white


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"`image` must be a readable file; got .*nowhere\.pgm"):
        read_gray_image(tmp_path / "nowhere.pgm")


SETTINGS = {
    "image": "map.pgm",
    "resolution": 0.05,
    "origin": [0.0, 0.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """A function that writes a map of given pixels and settings and reads it."""
    folder = tmp_path_factory.mktemp("map")

    def write_and_read(pixels=((254, 0),), text=None, drop=(), **settings):
        pixels = np.array(pixels, dtype=np.uint8)
        if pixels.ndim == 2:
            rows, columns = pixels.shape
            header = b"P5\n# a map\n%d %d\n255\n" % (columns, rows)
            (folder / "map.pgm").write_bytes(header + pixels.tobytes())
        cv2.imwrite(str(folder / "map.png"), pixels)
        chosen = {key: value for key, value in (SETTINGS | settings).items() if key not in drop}
        path = folder / "map.yaml"
        path.write_text(yaml.safe_dump(chosen) if text is None else text, encoding="utf-8")
        return read_occupancy_map(path)

    return write_and_read


def classes(occupancy: OccupancyMap) -> list[int]:
    return occupancy.cells.ravel().tolist()


def test_the_first_row_of_the_picture_is_the_top_of_the_map(read):
    occupancy = read([[254, 254], [0, 254]])
    assert occupancy.cells.tolist() == [[OCCUPIED, FREE], [FREE, FREE]]


def test_white_is_free_black_occupied_and_gray_unknown(read):
    # The gray that map_saver writes for unknown has p = 50 / 255 = 0.19608.
    assert classes(read([[254, 205, 0]])) == [FREE, UNKNOWN, OCCUPIED]


def test_the_map_s_own_thresholds_decide(read):
    assert classes(read([[254, 205, 0]], free_thresh=0.25)) == [FREE, FREE, OCCUPIED]
    assert classes(read([[254, 205, 0]], free_thresh=0.1, occupied_thresh=0.15)) == [
        FREE,
        OCCUPIED,
        OCCUPIED,
    ]


def test_a_pixel_on_a_threshold_is_unknown(read):
    # p = (255 - 204) / 255 = 0.2 and (255 - 102) / 255 = 0.6.
    pixels = [[205, 204, 203, 103, 102, 101]]
    assert classes(read(pixels, free_thresh=0.2, occupied_thresh=0.6)) == [
        FREE,
        UNKNOWN,
        UNKNOWN,
        UNKNOWN,
        UNKNOWN,
        OCCUPIED,
    ]


@pytest.mark.parametrize("negate", [1, True])
def test_negate_swaps_black_and_white(read, negate):
    assert classes(read([[254, 128, 0]], negate=negate)) == [OCCUPIED, UNKNOWN, FREE]


def test_colours_are_averaged_evenly(read):
    # Weighed by brightness, blue would count far less than green.
    pixels = [[[255, 0, 0], [0, 255, 0], [255, 255, 255]]]
    cells = classes(read(pixels, image="map.png", occupied_thresh=0.66, free_thresh=0.1))
    assert cells == [OCCUPIED, OCCUPIED, FREE]


def test_alpha_is_one_more_channel_in_trinary_mode(read):
    # (3 * 255 + 0) / 4 gives p = 0.25; (0 + 0 + 0 + 255) / 4 gives p = 0.75.
    pixels = [[[255, 255, 255, 0], [0, 0, 0, 255], [255, 255, 255, 255]]]
    cells = classes(read(pixels, image="map.png", mode="trinary"))
    assert cells == [UNKNOWN, OCCUPIED, FREE]


def test_scale_mode_takes_what_is_not_opaque_for_unknown(read):
    pixels = [[[255, 255, 255, 254], [0, 0, 0, 254], [255, 255, 255, 255], [0, 0, 0, 255]]]
    cells = classes(read(pixels, image="map.png", mode="scale"))
    assert cells == [UNKNOWN, UNKNOWN, FREE, OCCUPIED]


def test_scale_mode_grades_what_lies_between_the_thresholds(read):
    # Thresholds 0.2 and 0.6: p = 0.2 is 0 % and p = 0.6 is 100 %, both certain; 0.4 is not.
    cells = classes(
        read([[255, 204, 153, 102, 0]], mode="scale", free_thresh=0.2, occupied_thresh=0.6)
    )
    assert cells == [FREE, FREE, UNKNOWN, OCCUPIED, OCCUPIED]


def test_raw_mode_takes_pixels_for_percent(read):
    for negate in (0, 1):
        cells = classes(read([[0, 19, 20, 65, 66, 100, 101, 255]], mode="raw", negate=negate))
        assert cells == [FREE, FREE, UNKNOWN, UNKNOWN, OCCUPIED, OCCUPIED, UNKNOWN, UNKNOWN]


def test_the_origin_is_the_pose_of_the_lower_left_corner(read):
    occupancy = read(resolution=0.5, origin=[10.0, 20.0, np.pi / 2])
    # Columns run north, rows run west.
    np.testing.assert_allclose(
        occupancy.to_world(np.array([[0, 0], [2, 0], [0, 2], [2, 2]])),
        [[10, 20], [10, 21], [9, 20], [9, 21]],
        atol=1e-12,
    )


def test_numbers_may_be_written_as_map_server_reads_them(read):
    text = yaml.safe_dump(SETTINGS).replace("0.05", "5e-2")
    assert read(text=text).resolution == 0.05


def test_the_picture_is_looked_up_beside_the_yaml_file(read, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert classes(read()) == [FREE, OCCUPIED]


@pytest.mark.parametrize("key", list(SETTINGS))
def test_a_missing_key_is_named(read, key):
    with pytest.raises(InvalidInput, match=f"`map file` must have the key {key}"):
        read(drop=[key])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"resolution": 0}, "`resolution` must be between .*; got 0"),
        ({"resolution": -0.05}, "`resolution` must be between"),
        ({"resolution": float("nan")}, "`resolution` must be a finite number; got nan"),
        ({"resolution": "fine"}, "`resolution` must be a finite number; got 'fine'"),
        ({"resolution": True}, "`resolution` must be a finite number; got True"),
        ({"resolution": None}, "`resolution` must be a finite number; got None"),
        ({"origin": [0, 0]}, r"`origin` must be a list \[x, y, yaw\]; got \[0, 0\]"),
        ({"origin": 0}, r"`origin` must be a list \[x, y, yaw\]; got 0"),
        ({"origin": [0, float("inf"), 0]}, r"`origin\[1\]` must be a finite number; got inf"),
        ({"occupied_thresh": 1.5}, "`occupied_thresh` must be between 0 and 1; got 1.5"),
        ({"free_thresh": float("nan")}, "`free_thresh` must be a finite number; got nan"),
        ({"free_thresh": 0.7}, "`free_thresh` must be at most occupied_thresh = 0.65; got 0.7"),
        ({"negate": "no way"}, "`negate` must be one of 0, 1, False, True; got no way"),
        ({"mode": "sharp"}, "`mode` must be one of trinary, scale, raw; got sharp"),
        ({"image": ""}, "`image` must name a file; got ''"),
        ({"image": 7}, "`image` must name a file; got 7"),
        ({"image": "other.pgm"}, "`image` must be a readable file; got .*other.pgm"),
        ({"resolutoin": 0.05}, "`map file` must have only the keys .*; got resolutoin"),
    ],
)
def test_a_bad_value_is_named(read, settings, message):
    with pytest.raises(InvalidInput, match=message):
        read(**settings)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "`map file` must map keys to values; got NoneType"),
        ("- a\n- b\n", "`map file` must map keys to values; got list"),
        ("image: [", "`map file` must be a readable YAML file"),
        ("image: " + "[" * 10_000, "`map file` must be a readable YAML file"),
        ("image: a.pgm\nimage: b.pgm\n", r"`map file` must .* line 2 both say `image`"),
        ("a: !!python/object:os.system b", "`map file` must be a readable YAML file"),
    ],
)
def test_a_malformed_file_is_refused(read, text, message):
    with pytest.raises(InvalidInput, match=message) as raised:
        read(text=text)
    assert "\n" not in str(raised.value)


def test_a_map_without_a_free_cell_is_refused(read):
    with pytest.raises(InvalidInput, match=r"`image` must have a free cell; got none in map\.pgm"):
        read([[205, 0]])


def test_a_missing_or_binary_file_is_refused(tmp_path):
    (tmp_path / "map.yaml").write_bytes(b"\xff\xfe\xfd")
    for name in ("map.yaml", "nowhere.yaml"):
        with pytest.raises(InvalidInput, match="`map file` must be a readable YAML file"):
            read_occupancy_map(tmp_path / name)


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 3),
    st.floats(),
    st.sampled_from(["map.pgm", "trinary", "raw", "1e-1", ".nan", "\0"]),
    st.lists(st.floats(-2, 2), min_size=2, max_size=4),
)


@given(
    key=st.sampled_from([*SETTINGS, "mode", "yaw"]),
    value=VALUES,
    pixels=st.lists(st.integers(0, 255), min_size=1, max_size=6),
)
def test_any_setting_gives_a_map_or_one_clear_line(read, key, value, pixels):
    complaint, occupancy = "", None
    try:
        occupancy = read([pixels], **{key: value})
    except InvalidInput as error:
        complaint = str(error)
    if occupancy is None:
        assert complaint.startswith("`")
        assert "\n" not in complaint
        return
    assert occupancy.cells.shape == (1, len(pixels))
    assert set(classes(occupancy)) <= {FREE, OCCUPIED, UNKNOWN}
    assert np.isfinite(occupancy.to_world(np.array([[1.0, 1.0]]))).all()


@given(text=st.text(max_size=60))
def test_any_text_is_refused_in_one_clear_line(read, text):
    with pytest.raises(InvalidInput) as raised:
        read(text=text)
    assert str(raised.value).startswith("`")

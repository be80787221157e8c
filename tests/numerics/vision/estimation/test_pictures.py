"""Picture files are read whole or refused, and folders say where their shells stood."""

import math
import os
import resource
import struct
import zlib

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.labelled_pictures import (
    LabelledPicture,
    load_pictures,
    read_labels,
    save_pictures,
)
from sightfield.systems.numerics.vision.estimation.pictures import (
    load_picture,
    save_picture,
    stated_size,
)


@pytest.fixture
def picture():
    """Colourful noise, smooth enough for JPEG."""
    noise = np.random.default_rng(0).integers(0, 255, (6, 8, 3), np.uint8)
    return cv2.resize(noise, (80, 60), interpolation=cv2.INTER_LINEAR)


def test_a_png_comes_back_as_it_was(tmp_path, picture):
    save_picture(tmp_path / "a.png", picture)
    assert np.array_equal(load_picture(tmp_path / "a.png"), picture)


def test_alpha_is_left_out(tmp_path, picture):
    alpha = np.dstack([picture[:, :, ::-1], np.full((60, 80), 9, np.uint8)])
    cv2.imwrite(str(tmp_path / "a.png"), alpha)
    assert np.array_equal(load_picture(tmp_path / "a.png"), picture)


def test_a_jpeg_keeps_red_red(tmp_path, picture):
    cv2.imwrite(str(tmp_path / "a.jpg"), picture[:, :, ::-1])
    assert np.abs(load_picture(tmp_path / "a.jpg").astype(int) - picture).mean() < 5


@pytest.mark.parametrize("suffix", ["png", "jpg"])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.7, 0.99])
def test_a_file_cut_short_is_refused(tmp_path, picture, suffix, share):
    path = tmp_path / f"a.{suffix}"
    cv2.imwrite(str(path), picture)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(InvalidInput, match=rf"`picture` must be a whole .*; got .*a\.{suffix}"):
        load_picture(path)


@pytest.mark.parametrize(
    ("name", "pixels", "message"),
    [
        ("deep.png", np.zeros((4, 5, 3), np.uint16), "`picture` must hold 8-bit .*; got uint16"),
        ("grey.png", np.zeros((4, 5), np.uint8), "`picture` must have colours; got .*grey.png"),
    ],
)
def test_other_depths_are_refused(tmp_path, name, pixels, message):
    cv2.imwrite(str(tmp_path / name), pixels)
    with pytest.raises(InvalidInput, match=message):
        load_picture(tmp_path / name)


def test_what_is_no_picture_file_is_refused(tmp_path):
    (tmp_path / "a.txt").write_text("hello")
    (tmp_path / "a.png").write_bytes(b"\x89PNG IDAT junk IEND")
    for name, message in (
        ("a.txt", "must end in"),
        ("a.png", "must be a whole PNG or JPEG file"),
        ("b.png", "must be readable"),
    ):
        with pytest.raises(InvalidInput, match=message):
            load_picture(tmp_path / name)


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_a_picture_that_would_fill_the_memory_is_not_decoded(tmp_path, picture, suffix):
    path = tmp_path / f"a.{suffix}"
    cv2.imwrite(str(path), picture)
    data = bytearray(path.read_bytes())
    # The header says so: of a PNG with its checksum, of a JPEG in the start of frame.
    if suffix == "png":
        data[16:24] = struct.pack(">II", 60_000, 50_000)
        data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    else:
        frame = data.index(b"\xff\xc0")
        data[frame + 5 : frame + 9] = struct.pack(">HH", 50_000, 60_000)
    path.write_bytes(data)
    with pytest.raises(InvalidInput, match=r"at most 50,000,000 pixels; got .*, 60000 x 50000"):
        load_picture(path)


def test_a_png_with_a_damaged_byte_is_refused_before_the_decoder_complains(
    tmp_path, picture, capfd
):
    save_picture(tmp_path / "a.png", picture)
    whole = (tmp_path / "a.png").read_bytes()
    for place in (20, len(whole) // 3, len(whole) // 2):
        damaged = bytearray(whole)
        damaged[place] ^= 0xFF
        (tmp_path / "a.png").write_bytes(damaged)
        with pytest.raises(InvalidInput, match="`picture` must be a whole PNG or JPEG file"):
            load_picture(tmp_path / "a.png")
    assert capfd.readouterr().err == ""


def test_pipes_and_devices_are_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "endless.png").symlink_to("/dev/zero")
    for name in ("pipe.png", "endless.png"):
        with pytest.raises(InvalidInput, match=f"`picture` must be a file; got .*{name}"):
            load_picture(tmp_path / name)


def test_names_say_the_place(tmp_path, picture):
    names = {
        "15in_90deg.png": (0.381, math.pi / 2),
        "red_0.5m_-1.5rad.png": (0.5, -1.5),
        "640mm_270deg_again.png": (0.64, -math.pi / 2),
        "60cm_+45deg.png": (0.6, math.pi / 4),
    }
    for name in names:
        save_picture(tmp_path / name, picture)
    (tmp_path / "notes.txt").write_text("windy")
    found = {label.file.name: (label.distance, label.bearing) for label in read_labels(tmp_path)}
    assert found.keys() == names.keys()
    for name, place in names.items():
        assert found[name] == pytest.approx(place)


def test_a_picture_without_room_is_no_picture_that_was_written(tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (50, 50, 3), dtype=np.uint8)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            save_picture(tmp_path / "a.png", noise)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_table_says_the_place(tmp_path, picture):
    for name in ("a.png", "b.png"):
        save_picture(tmp_path / name, picture)
    table = "file, distance_in, bearing_deg\na.png, 20, 180\nb.png, 30, -90\n"
    (tmp_path / "shells.csv").write_text(table)
    a, b = load_pictures(read_labels(tmp_path))
    assert (a.name, a.distance, a.bearing) == ("a.png", pytest.approx(0.508), math.pi)
    assert (b.name, b.distance, b.bearing) == ("b.png", pytest.approx(0.762), -math.pi / 2)
    assert np.array_equal(a.picture, picture)


def test_saved_pictures_come_back(tmp_path, picture):
    saved = [LabelledPicture("a.png", 0.1 + 0.2, -1.0, picture)]
    assert save_pictures(tmp_path, saved) == 1
    (again,) = load_pictures(read_labels(tmp_path))
    assert again[:3] == saved[0][:3]
    assert np.array_equal(again.picture, picture)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("name,distance_m,bearing_rad\n", "`shells.csv` must have a column file; got name"),
        ("file,distance_m\n", "`shells.csv` must have one column of bearing_rad, bearing_deg"),
        ("file,distance_m,distance_in,bearing_rad\n", "must have one column of distance_m"),
        ("file,distance_m,bearing_rad\n", "`pictures` must hold .* files; got none in"),
        ("file,distance_m,bearing_rad\nb.png,1,0\n", "line 2` must name a file in the folder"),
        ("file,distance_m,bearing_rad\na.png,far,0\n", "line 2` must hold numbers; got far"),
        ("file,distance_m,bearing_rad\na.png,1\n", "line 2` must hold numbers; got None"),
        ("file,distance_m,bearing_rad\na.png,-1,0\n", "line 2` must have a positive distance"),
        ("file,distance_m,bearing_rad\na.png,1,nan\n", "line 2` must have a finite bearing"),
        ("", "`shells.csv` must have a column file; got"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(tmp_path, picture, table, message):
    save_picture(tmp_path / "a.png", picture)
    (tmp_path / "shells.csv").write_text(table)
    with pytest.raises(InvalidInput, match=message):
        read_labels(tmp_path)


def test_a_name_without_a_place_is_refused(tmp_path, picture):
    save_picture(tmp_path / "holiday.png", picture)
    with pytest.raises(InvalidInput, match=r"a table shells.csv; got holiday.png"):
        read_labels(tmp_path)


def test_no_folder_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="`pictures` must be a folder"):
        read_labels(tmp_path / "nowhere")


def jpeg(*segments, end=b"\xff\xd9"):
    return b"\xff\xd8" + b"".join(segments) + b"\xff\xda\x00\x02pixels" + end


def frame(kind=0xC0, width=7, height=5):
    return struct.pack(">BBHBHHB", 0xFF, kind, 8, 8, height, width, 0)


def segment(kind, size=9):
    return struct.pack(">BBH", 0xFF, kind, size) + bytes(size - 2)


def test_the_size_of_a_jpeg_is_that_of_its_frame():
    for kind in range(0xC0, 0xD0):
        expected = None if kind in (0xC4, 0xC8, 0xCC) else (7, 5)
        assert stated_size(jpeg(frame(kind))) == expected, hex(kind)
    assert stated_size(jpeg(segment(0xE0), segment(0xDB, 67), frame(0xC2))) == (7, 5)
    # Markers without a length, and bytes that fill up.
    bare = [b"\xff\x01", *(bytes([0xFF, kind]) for kind in range(0xD0, 0xD9))]
    assert stated_size(jpeg(*bare, b"\xff\xff\xff", frame())) == (7, 5)
    assert stated_size(jpeg(b"\x00", frame())) is None
    assert stated_size(jpeg()) is None
    assert stated_size(jpeg(frame(), end=b"")) is None
    assert stated_size(jpeg(frame())[1:]) is None
    # A frame after the pixels is none; one that ends with the file is.
    assert stated_size(b"\xff\xd8\xff\xda\x00\x02" + frame() + b"\xff\xd9") is None


def chunk(kind, body=b""):
    whole = kind + body
    return struct.pack(">I", len(body)) + whole + struct.pack(">I", zlib.crc32(whole))


def test_the_size_of_a_png_is_that_of_its_header():
    start = b"\x89PNG\r\n\x1a\n"
    head = chunk(b"IHDR", struct.pack(">II", 640, 480) + b"\x08\x02\0\0\0")
    pixels, end = chunk(b"IDAT", b"pixels"), chunk(b"IEND")
    assert stated_size(start + head + chunk(b"tEXt", b"IEND") + pixels + end) == (640, 480)
    for spoilt in (
        start + head,
        start + head + end + pixels,
        start + head + end,
        start + head.replace(b"IHDR", b"IHDX") + pixels + end,
        start + head + pixels[:-1] + b"?" + end,
        b"x" + start + head + pixels + end,
        start + pixels + end,
        start,
    ):
        assert stated_size(spoilt) is None

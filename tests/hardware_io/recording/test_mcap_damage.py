"""What is found in an MCAP log from which pieces are taken, place by place."""

import struct

import numpy as np
import pytest

from sightfield.hardware_io.recording.log_records import ABOUT, PICTURE, SAMPLES
from sightfield.hardware_io.recording.mcap_log import (
    MAGIC,
    McapRunWriter,
    _cut_off,
    _definition,
    _lost_within,
    _number_of_pictures,
    is_mcap,
    read_mcap_records,
)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """Three seconds of a run, with its header twice in the first chunk or two."""
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    with McapRunWriter(
        path, ports={"a": 2}, pictures=("eye", "left.eye"), memory={"/x": 1}, about={"seed": 3}
    ) as writer:
        for tick in range(61):
            time = 0.05 * tick + 1e-4
            writer.samples(time, np.array([tick, -tick]))
            writer.memory(time, np.array([0.5 * tick]))
            if tick % 9 == 4:
                writer.picture(time, ("eye", "left.eye")[tick % 2], bytes(range(1 + tick)))
    return path.read_bytes()


@pytest.fixture(scope="module")
def whole(data):
    return read_mcap_records(data)


def chunks_of(found):
    return sorted({(each.start, each.end) for each in found.records})


def test_a_whole_log_has_all_its_rows_and_pictures(whole):
    assert (whole.complete, whole.damaged, whole.unread) == (True, 0, 0)
    assert [each.kind for each in whole.records[:2]] == [ABOUT, ABOUT]
    rows = [each for each in whole.records if each.kind == SAMPLES]
    assert [each.time for each in rows] == [0.05 * tick + 1e-4 for tick in range(61)]
    assert [struct.unpack("<2d", each.body) for each in rows] == [(k, -k) for k in range(61)]
    pictures = [each for each in whole.records if each.kind == PICTURE]
    ticks = range(4, 61, 9)
    assert [each.time for each in pictures] == [0.05 * tick + 1e-4 for tick in ticks]
    assert [each.body for each in pictures] == [
        struct.pack("<H", tick % 2) + bytes(range(1 + tick)) for tick in ticks
    ]
    assert len(chunks_of(whole)) > 3


def test_a_chunk_that_is_damaged_or_gone_is_one_and_the_others_are_read(data, whole):
    for number, (start, end) in enumerate(chunks_of(whole)):
        kept = [each for each in whole.records if each.start != start]
        spoilt = bytearray(data)
        spoilt[end - 3] ^= 4
        found = read_mcap_records(bytes(spoilt))
        assert (found.complete, found.damaged) == (True, 1)
        if number > 1:
            assert found.records == kept
        # Without it and its index nothing but the sums tells.
        gone = read_mcap_records(data[:start] + data[end:])
        assert (gone.complete, gone.damaged, len(gone.records)) == (True, 1, len(found.records))


def test_a_log_that_ends_early_is_read_up_to_there(data, whole):
    places = chunks_of(whole)
    for start, end in places[2:]:
        before = [each for each in whole.records if each.end < end]
        for cut, unread in ((start, 0), (start + 3, 3), (start + 9, 9), (end - 1, end - 1 - start)):
            found = read_mcap_records(data[:cut])
            assert (found.complete, found.damaged) == (False, 0), cut - start
            assert found.unread == unread
            assert found.records == before
        found = read_mcap_records(data[:end])
        assert (found.damaged, found.unread) == (0, 0)
        assert len(found.records) > len(before)


def test_the_end_of_a_log_counts_without_its_last_mark_and_not_without_its_footer(data):
    for cut, complete in ((0, True), (len(MAGIC), False), (len(MAGIC) + 1, False)):
        found = read_mcap_records(data[: len(data) - cut])
        assert found.complete is complete, cut
    # A mark that is damaged leaves a footer that is right, and sums that cannot be.
    spoilt = data[:-1] + b"?"
    found = read_mcap_records(spoilt)
    assert (found.complete, found.damaged) == (True, 1)
    for at in (len(data) - len(MAGIC) - 3, len(data) - len(MAGIC) - 20):
        spoilt = bytearray(data)
        spoilt[at] ^= 1
        found = read_mcap_records(bytes(spoilt))
        assert (found.complete, found.damaged) == (True, 1)
        spoilt[-1] ^= 1
        assert not read_mcap_records(bytes(spoilt)).complete


def record(opcode, size, said=None):
    return struct.pack("<BQ", opcode, size if said is None else said) + bytes(size)


def test_records_between_chunks_are_counted():
    chunk, index, header, other = record(6, 20), record(7, 5), record(1, 9), record(4, 3)
    two = chunk + index + chunk
    assert _lost_within(two, 0, len(two)) == (2, True)
    assert _lost_within(two, 0, len(two) - 1) == (2, False)
    assert _lost_within(header + chunk, 0, len(header + chunk)) == (0, False)
    assert _lost_within(header + chunk, 0, len(header + chunk), header=True) == (1, True)
    assert _lost_within(chunk + other, 0, len(chunk + other)) == (1, False)
    assert _lost_within(b"", 0, 0) == (0, True)
    assert _lost_within(chunk[:8], 0, 8) == (0, False)


def test_what_was_being_written_is_not_lost():
    chunk, other = record(6, 20), record(4, 3)
    assert _cut_off(chunk + other, 0) == (1, 0)
    assert _cut_off(chunk + other[:-1], 0) == (1, len(other) - 1)
    assert _cut_off(chunk + other[:8], 0) == (1, 8)
    assert _cut_off(b"", 0) == (0, 0)
    assert _cut_off(record(15, 2), 0) == (0, 0)
    assert _cut_off(record(16, 2), 0) == (1, 0)
    assert _cut_off(record(0, 2), 0) == (1, 0)


def test_definitions_have_names_that_ros_takes():
    told = _definition({"a.pose": 3, "a_pose": 1, "2.Nothing": 0, "/x/Y": 2, "7": 1, "time": 4})
    assert told.splitlines() == [
        "float64 time",
        "float64[3] a_pose",
        "float64[1] a_pose_2",
        "float64[2] x_y",
        "float64[1] x_7",
        "float64[4] time_5",
    ]


def test_headers_without_pictures_have_none():
    assert _number_of_pictures(b'{"pictures": ["a", "b"]}') == 2
    for header in (b"", b"[]", b"{}", b'{"pictures": 7}', b"\xff"):
        assert _number_of_pictures(header) == 0


def test_an_mcap_log_is_known_by_its_mark_or_its_chunks(data):
    assert is_mcap(data)
    assert is_mcap(data[8:])
    assert not is_mcap(b"sightfield run log")

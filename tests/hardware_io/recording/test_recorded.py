"""The bytes of a log, and what is found in damaged ones, are as recorded."""

import json
import struct
import zlib

import numpy as np
import pytest

from sightfield.hardware_io.recording.log_records import (
    ABOUT,
    END,
    HEADER,
    LONGEST,
    MAGIC,
    MEMORY,
    PICTURE,
    SAMPLES,
    RunWriter,
    lost_records,
    pack,
    records,
)
from sightfield.hardware_io.recording.mcap_log import McapRunWriter, read_mcap_records
from sightfield.hardware_io.recording.run_log import PortRecorder, read_run_log
from sightfield.systems.numerics.errors import InvalidInput

PORTS = {"a.pose": 3, "b": 1}
SIZES = {SAMPLES: 32, MEMORY: 16}


def write(path, kind=RunWriter):
    with kind(
        path, ports=PORTS, pictures=("eye", "left.eye"), memory={"/x": 2}, about={"seed": 7}
    ) as writer:
        for tick in range(24):
            writer.samples(0.1 * tick, np.array([tick, -0.5, 0.25, np.inf]))
            writer.memory(0.1 * tick, np.array([tick, 2.0 * tick]))
            if tick % 5 == 2:
                writer.picture(0.1 * tick, ("eye", "left.eye")[tick % 2], bytes(range(tick)))


@pytest.fixture(scope="module")
def log_bytes(tmp_path_factory):
    path = tmp_path_factory.mktemp("bytes") / "run.log"
    write(path)
    return path.read_bytes()


@pytest.fixture(scope="module")
def mcap_bytes(tmp_path_factory):
    path = tmp_path_factory.mktemp("bytes") / "run.mcap"
    write(path, McapRunWriter)
    return path.read_bytes()


def test_the_bytes_of_a_log_are_as_recorded(log_bytes, as_recorded):
    as_recorded([len(log_bytes), log_bytes])
    rest = struct.pack("<Bd", SAMPLES, 2.5) + b"body"
    assert pack(SAMPLES, 2.5, b"body") == struct.pack("<II", 4, zlib.crc32(rest)) + rest
    assert (ABOUT, SAMPLES, PICTURE, END, MEMORY) == (0, 1, 2, 3, 4)


def told(data):
    """What is found in bytes, in few numbers."""
    found = list(records(data))
    if not found:
        return []
    kinds = "".join(str(each.kind) for each in found)
    where = [len(found), zlib.crc32(kinds.encode()), found[0].start, found[-1].end]
    return [*where, *lost_records(data, found, SIZES)]


def test_what_is_left_of_a_damaged_log_is_as_recorded(log_bytes, as_recorded):
    found = []
    for seed in range(60):
        rng, data = np.random.default_rng(seed), bytearray(log_bytes)
        for _ in range(1 + seed % 3):
            at = int(rng.integers(0, len(data) - 40))
            match seed % 4:
                case 0:
                    data[at] ^= 1 << int(rng.integers(8))
                case 1:
                    del data[at : at + int(rng.integers(1, 90))]
                case 2:
                    data[at:at] = rng.bytes(int(rng.integers(1, 60)))
                case 3:
                    del data[at:]
                    break
        found.append(told(bytes(data)))
    as_recorded(found)


def test_a_log_without_its_mark_or_beginning_is_read_as_recorded(log_bytes, as_recorded):
    cuts = [0, 1, len(MAGIC), len(MAGIC) + 1, len(MAGIC) + 200]
    as_recorded([told(log_bytes[cut:]) for cut in cuts], "begun late")
    ends = [len(log_bytes) - cut for cut in (0, 1, HEADER.size, HEADER.size + 1, 40, 60, 200)]
    as_recorded([told(log_bytes[:end]) for end in ends], "ended early")
    # A header that announces too much is no record.
    large = struct.pack("<IIBd", LONGEST + 1, 0, SAMPLES, 0.0)
    as_recorded(told(log_bytes[:-17] + large), "too long")
    unknown = bytearray(pack(SAMPLES, 9.0, bytes(32)))
    unknown[8] = 5
    unknown[4:8] = zlib.crc32(bytes(unknown[8:])).to_bytes(4, "little")
    as_recorded(told(log_bytes[:-17] + bytes(unknown) + log_bytes[-17:]), "of no known kind")


def shown(data):
    found = read_mcap_records(data)
    kinds = "".join(str(each.kind) for each in found.records)
    times = sum(each.time for each in found.records)
    return [len(kinds), zlib.crc32(kinds.encode()), times, found.complete, found.damaged]


def test_a_log_in_mcap_is_read_as_recorded(mcap_bytes, as_recorded):
    as_recorded(shown(mcap_bytes), "whole")
    found = read_mcap_records(mcap_bytes).records
    bodies = b"".join(each.body for each in found if each.kind != ABOUT)
    as_recorded([len(bodies), bodies, sorted({each.kind for each in found})], "bodies")


def test_what_is_left_of_a_damaged_log_in_mcap_is_told(mcap_bytes):
    whole = read_mcap_records(mcap_bytes)
    assert (whole.complete, whole.damaged, whole.unread) == (True, 0, 0)
    last = mcap_bytes.index(b"zstd", whole.records[-1].start)
    assert last == whole.records[-1].start + 9 + 28 + 4
    data = bytearray(mcap_bytes)
    data[last + 20] ^= 1
    spoilt = read_mcap_records(bytes(data))
    assert (spoilt.complete, spoilt.damaged) == (True, 1)
    assert len(spoilt.records) < len(whole.records)
    # Cut within the last chunk, and with half of a head after it.
    cut = read_mcap_records(mcap_bytes[: last + 20])
    assert (cut.complete, cut.damaged) == (False, 0)
    assert cut.unread == 20 + 4 + 9 + 28
    assert len(cut.records) == len(spoilt.records)


def test_a_log_is_read_as_recorded(log_bytes, tmp_path, as_recorded):
    (tmp_path / "run.log").write_bytes(log_bytes)
    log = read_run_log(tmp_path / "run.log")
    as_recorded(log)
    # A missing row shows in the times.
    rows = [each for each in records(log_bytes) if each.kind == SAMPLES]
    less = log_bytes[: rows[4].start] + log_bytes[rows[6].end :]
    (tmp_path / "less.log").write_bytes(less)
    assert read_run_log(tmp_path / "less.log").lost == 3


HEADER_OF_ALL = {"ports": {"a": 2}, "pictures": ["eye"], "memory": {"/x": 1}, "about": {}}


def log_with(header, *rest):
    return MAGIC + pack(ABOUT, 0.0, json.dumps(header).encode()) + b"".join(rest)


ROW = [pack(SAMPLES, 0.5 * k, struct.pack("<2d", k, -k)) for k in range(4)]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "be a log of a run"),
        (log_with([]), "have a header in JSON"),
        (MAGIC + pack(ABOUT, 0.0, b"{"), "have a header in JSON"),
        (log_with({**HEADER_OF_ALL, "ports": []}), "have ports with their sizes"),
        (log_with({**HEADER_OF_ALL, "ports": {"a": -1}}), "have ports with their sizes"),
        (log_with({**HEADER_OF_ALL, "ports": {"a": True}}), "have ports with their sizes"),
        (log_with({**HEADER_OF_ALL, "ports": {"a\n": 1}}), "have ports with their sizes"),
        (log_with({**HEADER_OF_ALL, "ports": {"a": LONGEST // 8 + 1}}), "have ports with"),
        (log_with({**HEADER_OF_ALL, "memory": {"/x": "1"}}), "have memory with their sizes"),
        (log_with({**HEADER_OF_ALL, "pictures": "eye"}), "have names of pictures"),
        (log_with({**HEADER_OF_ALL, "pictures": ["a\n"]}), "have names of pictures"),
        (log_with({**HEADER_OF_ALL, "about": None}), "say in its header what it is of"),
        (log_with(HEADER_OF_ALL, pack(SAMPLES, 0.0, bytes(24))), "have whole samples"),
        (log_with(HEADER_OF_ALL, pack(MEMORY, 0.0, bytes(16))), "have whole samples"),
        (log_with(HEADER_OF_ALL, ROW[1], ROW[0]), "have samples whose times rise"),
        (log_with(HEADER_OF_ALL, ROW[1], ROW[1]), "have samples whose times rise"),
        (log_with(HEADER_OF_ALL, pack(SAMPLES, np.inf, bytes(16))), "have samples whose times"),
        (log_with(HEADER_OF_ALL, pack(PICTURE, 0.0, b"\x01\x00x")), "have pictures of its own"),
    ],
)
def test_what_is_no_log_of_a_run_is_refused(data, message, tmp_path):
    (tmp_path / "run.log").write_bytes(data)
    with pytest.raises(InvalidInput, match=message):
        read_run_log(tmp_path / "run.log")


def test_a_log_may_have_little_in_it(tmp_path):
    path = tmp_path / "run.log"
    path.write_bytes(log_with({**HEADER_OF_ALL, "ports": {"a": 0}}))
    assert read_run_log(path).samples["a"].shape == (0, 0)
    less = {key: value for key, value in HEADER_OF_ALL.items() if key != "memory"}
    path.write_bytes(log_with(less, *ROW, pack(PICTURE, 0.5, b"\x00\x00png")))
    log = read_run_log(path)
    assert (log.lost, log.memory, log.pictures) == (0, [], {"eye": [(0.5, b"png")]})
    path.write_bytes(log_with(HEADER_OF_ALL, *ROW[:3], pack(SAMPLES, 3.0, bytes(16))))
    assert read_run_log(path).lost == 3
    with pytest.raises(InvalidInput, match="be a readable file"):
        read_run_log(tmp_path)
    with pytest.raises(InvalidInput, match="be a readable file"):
        read_run_log(tmp_path / "nowhere")


@pytest.mark.parametrize("change", [{"period": 0.0}, {"offset": -0.1}])
def test_a_recorder_has_a_period(change, tmp_path):
    with RunWriter(tmp_path / "run.log", ports=PORTS) as writer:
        PortRecorder(writer, period=0.1, offset=0.0)
        with pytest.raises(InvalidInput, match="` must"):
            PortRecorder(writer, **({"period": 0.1} | change))

"""A damaged log keeps what its bytes tell, and plays on to the bit; a wrong one is refused."""

import json
import random
import stat

import numpy as np
import pytest

from sightfield.diagrams.station.laboratories import ticks_of
from sightfield.diagrams.station.replay import load_recording, replay_station
from sightfield.diagrams.station.report import summarise_station, write_station_report
from sightfield.diagrams.station.run import HORIZON, StationRun, run_station
from sightfield.hardware_io.recording.log_records import (
    ABOUT,
    MAGIC,
    PICTURE,
    SAMPLES,
    pack,
    records,
)
from sightfield.hardware_io.recording.run_log import read_run_log
from sightfield.systems.numerics.errors import InvalidInput

# What a header may hold that it should not.
WILD = [
    *(None, True, -1, 0, 7, 1e300, -1e300, float("nan"), float("inf"), 10**30, 1e-9, 2**31),
    *("", "x", "\ud800", "../../etc/passwd", [], {}, [1], [[1]], {"a": 1}, [None], ["x"] * 3),
]


@pytest.fixture(scope="module")
def log_path(load_laboratory, tmp_path_factory):
    """Of a second in the simulated laboratory."""
    path = tmp_path_factory.mktemp("whole") / "run.log"
    scenario, game = load_laboratory("seconds=1")
    run_station(scenario, game, log=path, realtime_rate=0)
    return path


def damaged(data, dice):
    """A log with a bit flipped or its end cut off, and whether it was flipped."""
    bytes_, at = bytearray(data), dice.randrange(len(data))
    flipped = dice.random() < 0.5
    if flipped:
        bytes_[at] ^= 1 << dice.randrange(8)
    else:
        del bytes_[at:]
    return bytes(bytes_), flipped


def test_of_200_damaged_logs_no_sample_is_wrong_and_a_flip_loses_one_record(log_path, tmp_path):
    data, whole, dice = log_path.read_bytes(), read_run_log(log_path), random.Random(1)
    rows = {time: row for row, time in enumerate(whole.times)}
    for _ in range(200):
        broken, flipped = damaged(data, dice)
        (tmp_path / "run.log").write_bytes(broken)
        try:
            log = read_run_log(tmp_path / "run.log")
        except InvalidInput:
            assert not flipped
            continue
        left = [rows[time] for time in log.times]
        for name, samples in whole.samples.items():
            assert log.samples[name].tobytes() == samples[left].tobytes()
        assert log.lost == (1 if flipped else 0)
        assert len(left) >= len(rows) - 1 or not flipped


def without(data, lost):
    """A log with a bit flipped in each of some records, by kind and number of the tick."""
    broken, ticks = bytearray(data), {}
    for each in records(data):
        ticks[each.kind] = ticks.get(each.kind, -1) + 1
        if (each.kind, ticks[each.kind]) in lost:
            broken[each.end - 1] ^= 1
    return bytes(broken)


@pytest.mark.parametrize(
    "gone", [[0], [7], [20], [3, 4, 5, 9]], ids=["first", "middle", "last", "several"]
)
def test_what_is_left_is_played_to_identical_commands(log_path, tmp_path, gone):
    data = without(log_path.read_bytes(), [(SAMPLES, tick) for tick in gone])
    (tmp_path / "run.log").write_bytes(data)
    recording = load_recording(tmp_path / "run.log")
    assert recording.log.lost == len(gone)
    left = sorted({*range(21)} - {*gone})
    assert ticks_of(recording.log.times, recording.scenario.period).tolist() == left
    result = replay_station(recording, tmp_path / "again.log")
    assert (result.identical, result.differing, result.ticks) == (True, (), len(left))
    # After the last there is nothing to compare.
    assert result.missing == len([tick for tick in gone if tick < left[-1]])


def wrong(data, dice):
    """A log whose records are whole, and one of whose headers is wrong."""
    found = list(records(data))
    header = json.loads(found[0].body)
    others = [(each.kind, each.time, each.body) for each in found[2:]]
    if dice.random() < 0.8:
        place, depth = header, dice.randrange(1, 6)
        while True:
            key = dice.choice([*place] if isinstance(place, dict) else [*range(len(place))])
            depth -= 1
            if not depth or not isinstance(place[key], (dict, list)) or not place[key]:
                break
            place = place[key]
        place[key] = dice.choice(WILD)
    else:
        number = dice.randrange(len(others))
        kind, time, body = others[number]
        others[number] = dice.choice(
            [
                (dice.randrange(256), time, body),
                (kind, dice.choice([float("nan"), 1e300, -1.0, float("inf"), 1e12]), body),
                (kind, time, body[:-8]),
                (PICTURE, time, b"\xff\xffx"),
                (kind, time, b""),
            ]
        )
    body = json.dumps(header).encode()
    return MAGIC + 2 * pack(ABOUT, 0.0, body) + b"".join(pack(*each) for each in others)


def test_of_200_logs_with_wrong_headers_all_are_read_or_refused_in_one_line(log_path, tmp_path):
    data, dice, refused = log_path.read_bytes(), random.Random(2), []
    for _ in range(200):
        (tmp_path / "run.log").write_bytes(wrong(data, dice))
        try:
            load_recording(tmp_path / "run.log")
        except InvalidInput as error:
            refused.append(str(error))
    assert len(refused) > 100
    for message in refused:
        assert "\n" not in message
        message.encode()


@pytest.mark.parametrize("body", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b"7", b"{}"])
def test_a_header_that_is_no_header_is_refused(tmp_path, body):
    (tmp_path / "run.log").write_bytes(MAGIC + pack(ABOUT, 0.0, body))
    with pytest.raises(InvalidInput, match="`log` must have"):
        read_run_log(tmp_path / "run.log")


@pytest.mark.parametrize("value", [1e300, -1e155, np.nan, np.inf, 1e20])
def test_a_summary_is_written_whatever_the_numbers_are(log_path, tmp_path, value):
    recording = load_recording(log_path)
    for samples in recording.log.samples.values():
        samples[5:9] = value
    run = StationRun(HORIZON, 1.0, None, 1.0, 1.0)
    summary = summarise_station(run, recording.log, recording.game, "thesis_3v3", 1.0, "emulate")
    names = write_station_report(run, recording.log, recording.game, summary, tmp_path)
    assert {each.name for each in tmp_path.glob("[!.]*")} == {*names}
    text = (tmp_path / "summary.json").read_text()
    assert json.loads(text, parse_constant=pytest.fail)["ticks"] == 21


def test_a_log_is_for_the_user_alone_and_holds_no_password(load_laboratory, tmp_path):
    scenario, game = load_laboratory(
        "seconds=0.1",
        "omni_camera.source=none",
        "omni_camera.place=rtsp://guard:hunter2@camera/stream?token=swordfish",
    )
    run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0)
    data = (tmp_path / "run.log").read_bytes()
    assert b"hunter2" not in data
    assert b"swordfish" not in data
    assert b"@camera/stream" in data
    assert stat.S_IMODE((tmp_path / "run.log").stat().st_mode) == 0o600

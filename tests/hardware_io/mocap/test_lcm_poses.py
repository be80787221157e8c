"""Poses by LCM: the bytes are those of lcm-gen's type, and nothing else is believed."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.lcm import DrakeLcm

from sightfield.hardware_io.mocap.lcm_poses import (
    FINGERPRINT,
    LcmPoses,
    PosesMessage,
    decode,
    encode,
)
from sightfield.systems.numerics.errors import InvalidInput

# What the Python that lcm-gen 1.5.1 makes of sightfield_poses.lcm encodes.
MESSAGE = PosesMessage(123, ("r0", "rä1"), ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0)), (True, False))
BYTES = bytes.fromhex(
    "08f1ad13f09ea037000000000000007b00000002000000037230000000000572c3a431003ff0000000000000"
    "401000000000000040000000000000004014000000000000400800000000000040180000000000000100"
)

numbers = st.floats(allow_nan=False)
bodies = st.lists(
    st.tuples(
        st.text(st.characters(exclude_characters="\0", exclude_categories=("Cs",))),
        st.tuples(numbers, numbers, numbers),
        st.booleans(),
    ),
    max_size=5,
)


def test_the_layout_is_that_of_lcm_gen():
    assert encode(MESSAGE) == BYTES
    assert decode(BYTES) == MESSAGE


@given(st.integers(-(2**63), 2**63 - 1), bodies)
def test_decoding_undoes_encoding(utime, robots):
    names, poses, valid = zip(*robots, strict=True) if robots else ((), (), ())
    message = PosesMessage(utime, names, poses, valid)
    assert decode(encode(message)) == message


# Twelve bytes may say when, and that there are no bodies.
@given(st.binary(max_size=200).filter(lambda data: len(data) != 12))
def test_other_bytes_are_refused_in_one_line(data):
    for each in (data, FINGERPRINT + data, BYTES + data[:1] if data else BYTES[:-1]):
        with pytest.raises(InvalidInput) as error:
            decode(each)
        assert "\n" not in str(error.value)


def test_a_whole_message_of_another_type_is_refused():
    with pytest.raises(InvalidInput, match=r"must be a sightfield\.poses_t; got 0123456789abcdef"):
        decode(bytes.fromhex("0123456789abcdef") + BYTES[8:])


@given(st.integers(0, len(BYTES) - 1))
def test_a_message_that_is_cut_off_is_refused(length):
    with pytest.raises(InvalidInput):
        decode(BYTES[:length])


def test_names_poses_and_validity_go_together():
    with pytest.raises(InvalidInput, match="have 1 poses"):
        encode(PosesMessage(0, ("a",), (), ()))


def wait_for(condition):
    """Until it holds, at most five seconds; whether it does."""
    deadline = time.monotonic() + 5
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.005)
    return condition()


def test_messages_become_poses_and_what_is_none_does_no_harm():
    lcm = DrakeLcm("memq://")
    source = LcmPoses("memq://", "POSES", ["rä1", "r0"], lcm=lcm)
    before = time.monotonic()
    lcm.Publish("POSES", b"nonsense")
    lcm.Publish("POSES", encode(PosesMessage(0, ("other",), ((9.0, 9.0, 9.0),), (True,))))
    lcm.Publish("POSES", encode(PosesMessage(1, ("r0",), ((np.nan, 0.0, 0.0),), (True,))))
    lcm.Publish("POSES", BYTES)
    assert wait_for(lambda: np.isfinite(source.read().stamps[1]))
    source.close()
    reading = source.read()
    # The message calls the other one invalid.
    assert reading.poses.tolist() == [[0, 0, 0], [1, 2, 3]]
    assert reading.stamps[0] == -np.inf
    assert before <= reading.stamps[1] <= time.monotonic()


def test_a_sender_that_repeats_itself_goes_stale():
    lcm = DrakeLcm("memq://")
    source = LcmPoses("memq://", "POSES", ["r0"], lcm=lcm)
    lcm.Publish("POSES", BYTES)
    assert wait_for(lambda: np.isfinite(source.read().stamps[0]))
    first = source.read().stamps[0]
    for _ in range(3):
        time.sleep(0.02)
        lcm.Publish("POSES", BYTES)
    time.sleep(0.05)
    assert source.read().stamps[0] == first
    lcm.Publish("POSES", encode(PosesMessage(124, ("r0",), ((1.0, 2.0, 3.0),), (True,))))
    assert wait_for(lambda: source.read().stamps[0] > first)
    source.close()


def test_what_is_no_network_is_refused():
    with pytest.raises(InvalidInput, match=r"`mocap\.url` must begin with udpm://; got http://x"):
        LcmPoses("http://x", "POSES", ["r0"])

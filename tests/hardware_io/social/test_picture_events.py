"""Pictures become messages and come back; whatever else people write is taken in its stride."""

import json

from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.social.picture_events import (
    media_type,
    message_of,
    posted_picture,
    transaction_of,
)
from sightfield.systems.numerics.social.network.interface import Picture

PNG = b"\x89PNG\r\n\x1a\n and so on"
ADDRESS = "mxc://maze.test/abc"


def event_of(content):
    return {
        "type": "m.room.message",
        "event_id": "$e",
        "origin_server_ts": 1500,
        "content": content,
    }


@given(st.text(min_size=1), st.floats(allow_nan=False, allow_infinity=False), st.binary())
def test_a_picture_comes_back_from_its_message(name, time, data):
    picture = Picture(id=name, agent=0, time=time, data=data)
    sent = json.loads(json.dumps(message_of(picture, "run", ADDRESS)))
    posted = posted_picture(event_of(sent))
    assert posted is not None
    assert (posted.id, posted.run, posted.address) == (name, "run", ADDRESS)
    assert posted.time == time
    assert posted.fits(data)
    assert not posted.fits(data + b"x")


def test_a_message_holds_no_fractions_for_servers_refuse_them():
    message = message_of(Picture(id="a", agent=0, time=1.5, data=PNG), "run", ADDRESS)
    assert not any(isinstance(value, float) for value in [*message.values()])
    assert message["net.sightfield.picture"]["time"] == "1.5"
    assert message["info"] == {"mimetype": "image/png", "size": len(PNG)}


def test_a_picture_from_another_program_is_named_by_its_event_and_taken_when_sent():
    posted = posted_picture(event_of({"msgtype": "m.image", "body": "x", "url": ADDRESS}))
    assert posted is not None
    assert (posted.id, posted.run, posted.digest) == ("$e", None, None)
    assert posted.time == 1.5
    assert posted.fits(b"anything")


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5) | st.just(ADDRESS),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(
                ["msgtype", "url", "id", "run", "time", "sha256", "net.sightfield.picture", "body"]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(json_values, st.sampled_from(["m.room.message", "m.room.name", None]), json_values)
def test_no_event_makes_it_stumble(content, kind, sent):
    image = content | {"msgtype": "m.image", "url": ADDRESS} if isinstance(content, dict) else 0
    for each in (content, image):
        event = event_of(each) | {"type": kind, "origin_server_ts": sent}
        posted = posted_picture(event)
        if posted is not None:
            assert posted.address.startswith("mxc://")
            assert isinstance(posted.id, str)
            assert abs(posted.time) < float("inf")


def test_a_picture_has_one_transaction_and_others_have_others():
    one, two = (Picture(id=name, agent=0, time=0.0, data=b"") for name in "ab")
    found = [transaction_of(one, "run"), transaction_of(two, "run"), transaction_of(one, "other")]
    assert len(set(found)) == 3
    assert transaction_of(one, "run") == found[0]


def test_media_types_are_told_by_the_first_bytes():
    assert media_type(PNG) == "image/png"
    assert media_type(b"\xff\xd8\xff\xe0") == "image/jpeg"
    assert media_type(b"") == "application/octet-stream"

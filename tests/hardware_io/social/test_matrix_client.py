"""Pictures become messages and come back; whatever else people write is taken in its stride.

What fails for now is tried again, and what the server refuses is not.
"""

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import aiohttp
import nio
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.social.accounts import ServerRefusal
from sightfield.hardware_io.social.matrix_client import (
    Background,
    Mailbox,
    media_type,
    message_of,
    persist,
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


def error(status, code, retry_after_ms=None):
    response = nio.ErrorResponse("words", code, retry_after_ms)
    response.transport_response = SimpleNamespace(status=status)
    return response


def finish(coroutine):
    """Its result, from a thread of its own: Playwright leaves a loop running in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, coroutine).result()


def scripted(*outcomes):
    """A call with these outcomes, one after the other; and how often it was made."""
    left = list(outcomes)

    async def call():
        outcome = left.pop(0)
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    return call, left


@pytest.mark.parametrize(
    "trouble",
    [
        ConnectionRefusedError(),
        aiohttp.ClientPayloadError("half"),
        aiohttp.ServerDisconnectedError(),
        TimeoutError(),
        error(500, "M_UNKNOWN"),
        error(502, None),
        error(429, "M_LIMIT_EXCEEDED", 10),
        error(400, "M_LIMIT_EXCEEDED", 10),
    ],
)
def test_passing_trouble_is_outlasted(trouble):
    call, left = scripted(trouble, trouble, "done")
    assert finish(persist(call, "do it")) == "done"
    assert left == []


@pytest.mark.parametrize(
    "refusal",
    [error(403, "M_FORBIDDEN"), error(401, "M_UNKNOWN_TOKEN"), error(413, "M_TOO_LARGE")],
)
def test_a_refusal_is_final(refusal):
    call, left = scripted(refusal, "not asked any more")
    with pytest.raises(ServerRefusal, match=f"refuses to do it: {refusal.status_code} words"):
        finish(persist(call, "do it"))
    assert left == ["not asked any more"]


def test_the_server_says_how_long_to_wait():
    async def timed():
        call, _ = scripted(error(429, "M_LIMIT_EXCEEDED", 400), "done")
        loop = asyncio.get_running_loop()
        start = loop.time()
        await persist(call, "do it")
        return loop.time() - start

    assert finish(timed()) >= 0.4


def test_a_mailbox_carries_errands_out_in_order_and_a_failure_is_raised_by_check(eventually):
    background = Background("test")
    mailbox, done = Mailbox(background), []

    async def errand(number):
        await asyncio.sleep(0.01 * (3 - number))
        done.append(number)

    for number in range(3):
        mailbox.put(lambda number=number: errand(number))
    eventually(lambda: mailbox.waiting == 0)
    assert done == [0, 1, 2]
    background.check()

    async def fail():
        raise ServerRefusal("no")

    background.spawn(fail)

    def failed():
        try:
            background.check()
        except ServerRefusal:
            return True
        return False

    async def nothing():
        pass

    eventually(failed)
    background.close(nothing)
    background.close(nothing)

"""What fails for now is tried again, and what the server refuses is not."""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import aiohttp
import nio
import pytest

from sightfield.hardware_io.social.accounts import ServerRefusal
from sightfield.hardware_io.social.persistence import Background, Mailbox, persist


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

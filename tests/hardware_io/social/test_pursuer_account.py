"""A mirror has an album's pictures in their order, whole, whatever way they come."""

import asyncio
import hashlib
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import nio
import pytest

from sightfield.hardware_io.social.pursuer_account import AlbumMirror, Run

RUN = Run("run", 1000.0)


def data_of(number):
    return b"picture %d" % number


def event(number, run="run"):
    """A message with a picture, as parsed from the server's answer."""
    own = {
        "id": f"0/{number}",
        "run": run,
        "time": str(float(number)),
        "sha256": hashlib.sha256(data_of(number)).hexdigest(),
    }
    content = {
        "msgtype": "m.image",
        "url": f"mxc://maze.test/{number}",
        "net.sightfield.picture": own,
    }
    source = {
        "type": "m.room.message",
        "event_id": f"${number}",
        "origin_server_ts": 1_000_000 + 1000 * number,
        "content": content,
    }
    return SimpleNamespace(source=source)


def news(numbers, earlier=None, run="run"):
    events = [event(number, run) for number in numbers]
    timeline = SimpleNamespace(events=events, limited=earlier is not None, prev_batch="there")
    return SimpleNamespace(timeline=timeline)


class Server:
    """Answers downloads, some of them damaged, and pages of earlier messages."""

    def __init__(self, damaged=0, earlier=()):
        self.damaged, self.earlier, self.asked = damaged, earlier, []

    async def download(self, address):
        number = int(address.rsplit("/", 1)[1])
        self.asked.append(number)
        if len(self.asked) <= self.damaged:
            return SimpleNamespace(body=data_of(number)[:4])
        return SimpleNamespace(body=data_of(number))

    async def room_messages(self, room, start, limit):
        assert (room, start) == ("!album", "there")
        if self.earlier is None:
            refusal = nio.RoomMessagesError("not a member", "M_FORBIDDEN")
            refusal.transport_response = SimpleNamespace(status=403)
            return refusal
        return SimpleNamespace(chunk=[event(number) for number in reversed(self.earlier)])


def mirrored(server, *all_news, newest=4, wanted, run=RUN):
    """Names of the pictures in a mirror, newest first, once there are as many as wanted."""

    async def work():
        mirror = AlbumMirror(server, 0, "!album", newest)
        fetching = asyncio.create_task(mirror.fetch())
        for each in all_news:
            await mirror.take(each)
        async with asyncio.timeout(20):
            while len(mirror.latest(9, run)) < wanted:
                await asyncio.sleep(0.01)
        fetching.cancel()
        return mirror.latest(9, run)

    # In a thread of its own: Playwright leaves a loop running in this one.
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work()).result()


def ids(pictures):
    return [each.id for each in pictures]


def test_pictures_are_newest_first_as_posted_and_none_is_there_twice():
    found = mirrored(Server(), news([1, 2]), news([2, 3]), wanted=3)
    assert ids(found) == ["0/3", "0/2", "0/1"]
    assert [each.data for each in found] == [data_of(number) for number in (3, 2, 1)]
    assert [each.time for each in found] == [3.0, 2.0, 1.0]


def test_what_the_news_leave_out_is_asked_for():
    server = Server(earlier=[1, 2, 3])
    assert ids(mirrored(server, news([1]), news([4], earlier=True), wanted=4)) == [
        "0/4",
        "0/3",
        "0/2",
        "0/1",
    ]


def test_a_former_friend_that_may_not_ask_makes_do_with_the_news():
    server = Server(earlier=None)
    assert ids(mirrored(server, news([4], earlier=True), wanted=1)) == ["0/4"]


@pytest.mark.parametrize("damaged", [1, 3])
def test_a_file_that_comes_damaged_is_fetched_again(damaged):
    (found,) = mirrored(Server(damaged=damaged), news([1]), wanted=1)
    assert found.data == data_of(1)


def test_a_file_that_is_never_what_was_posted_does_not_keep_the_others_back():
    """The newest comes first, and is given up after five attempts."""
    server = Server(damaged=5)
    assert ids(mirrored(server, news([1, 2]), wanted=1)) == ["0/1"]
    assert server.asked == [2] * 5 + [1]


def test_the_newest_files_are_held_and_fetched_first():
    server = Server()
    assert ids(mirrored(server, news(range(9)), newest=2, wanted=2)) == ["0/8", "0/7"]
    assert server.asked == [8, 7]


def test_other_runs_are_not_shown():
    all_news = (news([1], run="earlier"), news([1]))
    assert len(mirrored(Server(), *all_news, wanted=1)) == 1
    assert len(mirrored(Server(), *all_news, wanted=1, run=Run("earlier", 0.0))) == 1


def test_a_picture_from_elsewhere_has_the_time_since_the_run_began():
    foreign = news([5])
    del foreign.timeline.events[0].source["content"]["net.sightfield.picture"]
    (found,) = mirrored(Server(), foreign, wanted=1)
    assert (found.id, found.time) == ("$5", 5.0)

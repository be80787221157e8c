"""Messages, outboxes and files of accounts are as recorded; what a server says is taken well."""

import asyncio
import os
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from sightfield.hardware_io.social import matrix_client
from sightfield.hardware_io.social.accounts import (
    Account,
    AgentAccount,
    SocialDirectory,
    load_directory,
    save_directory,
)
from sightfield.hardware_io.social.common_agents import Outbox
from sightfield.hardware_io.social.matrix_client import (
    message_of,
    persist,
    posted_picture,
    transaction_of,
)
from sightfield.hardware_io.social.pursuer_account import AlbumMirror, Run
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.interface import Picture

PICTURE = Picture(id="agent-1-picture-7", agent=1, time=3.5, data=b"\xff\xd8\xff data")


def test_messages_are_as_recorded(as_recorded):
    message = message_of(PICTURE, "run 5", "mxc://maze.test/abc")
    as_recorded([message, transaction_of(PICTURE, "run 5")], "message")
    event = {"type": "m.room.message", "event_id": "$e", "origin_server_ts": 1500}
    as_recorded(posted_picture(event | {"content": message}), "posted")
    less = {
        **message,
        "net.sightfield.picture": {"id": "x", "run": "y", "time": "nan", "sha256": 1},
    }
    as_recorded(posted_picture(event | {"content": less}), "without a time")
    as_recorded(posted_picture(event | {"content": less, "origin_server_ts": "x"}), "at no time")


def test_an_outbox_keeps_what_was_not_taken_as_recorded(tmp_path, as_recorded):
    outbox = Outbox(tmp_path / "out")
    pictures = [Picture(id=f"p{k}", agent=k, time=0.5 * k, data=bytes([k])) for k in range(3)]
    for each in pictures:
        outbox.keep(each, "run")
    names = sorted(each.name for each in (tmp_path / "out").iterdir())
    as_recorded(names)
    outbox.done(pictures[1], "run")
    # Another goes on with the numbers, and passes over what is none.
    again = Outbox(tmp_path / "out")
    again.keep(pictures[1], "other")
    assert again.waiting() == [(pictures[0], "run"), (pictures[2], "run"), (pictures[1], "other")]
    assert sorted(each.name for each in (tmp_path / "out").iterdir())[-1].startswith("0000000004-")
    Outbox(None).keep(pictures[0], "run")
    Outbox(None).done(pictures[0], "run")
    assert Outbox(None).waiting() == []


DIRECTORY = SocialDirectory(
    homeserver="https://maze.test",
    pursuer=Account(user="@p:maze.test", token="secret"),
    agents=(AgentAccount(user="@a:maze.test", album="!a:maze.test"),),
)


def test_accounts_are_kept_for_their_owner_alone(tmp_path):
    path = tmp_path / "accounts.yaml"
    save_directory(DIRECTORY, path)
    assert os.stat(path).st_mode & 0o777 == 0o600
    assert load_directory(path) == DIRECTORY
    for mode, good in (
        (0o400, True),
        (0o700, True),
        (0o640, False),
        (0o601, False),
        (0o620, False),
    ):
        path.chmod(mode)
        if good:
            assert load_directory(path) == DIRECTORY
        else:
            with pytest.raises(InvalidInput, match="be readable by you alone"):
                load_directory(path)


@pytest.mark.parametrize(
    ("homeserver", "good"),
    [
        ("http://localhost:8008", True),
        ("http://127.0.0.7", True),
        ("http://[::1]:8008", True),
        ("https://maze.test", True),
        ("http://maze.test", False),
        ("http://10.0.0.1", False),
        ("ftp://localhost", False),
    ],
)
def test_tokens_go_to_this_machine_or_are_encrypted(homeserver, good):
    make = {"homeserver": homeserver, "pursuer": DIRECTORY.pursuer, "agents": ()}
    if good:
        assert SocialDirectory(**make).homeserver == homeserver
    else:
        with pytest.raises(InvalidInput, match="`homeserver` must"):
            SocialDirectory(**make)


def test_waits_grow_and_last_as_recorded(monkeypatch, as_recorded):
    slept = []

    async def sleep(duration):
        slept.append(duration)

    times = SimpleNamespace(sleep=sleep, timeout=asyncio.timeout)
    monkeypatch.setattr(matrix_client, "asyncio", times)
    answers = [
        OSError("no way"),
        matrix_client.nio.ErrorResponse("busy", "M_LIMIT_EXCEEDED", retry_after_ms=700),
        *[OSError("no way")] * 5,
        SimpleNamespace(fine=True),
    ]

    async def call():
        answer = answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    # In a thread of its own: Playwright leaves a loop running in this one.
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(asyncio.run, persist(call, "listen")).result().fine
    as_recorded(slept)


@pytest.mark.parametrize(
    ("status", "code", "final"),
    [
        (399, "M_X", False),
        (400, "M_X", True),
        (403, "M_X", True),
        (499, "M_X", True),
        (500, "M_X", False),
        (408, "M_X", False),
        (425, "M_X", False),
        (429, "M_X", False),
        (403, "M_LIMIT_EXCEEDED", False),
        (None, "M_X", False),
    ],
)
def test_refusals_are_final_where_they_do_not_pass(status, code, final):
    response = matrix_client.nio.ErrorResponse("no", code)
    response.transport_response = None if status is None else SimpleNamespace(status=status)
    assert matrix_client._is_final(response) is final


def posted(number, run="run"):
    return matrix_client.PostedPicture(f"{number}", run, 100.0 + number, f"mxc://m/{number}", None)


def test_a_mirror_shows_the_newest_of_this_run_and_of_none():
    mirror = AlbumMirror(None, 4, "!room", 3)
    mirror._posted = [posted(0), posted(1, None), posted(2, "other"), posted(3), posted(4)]
    mirror._files = {each: each.id.encode() for each in mirror._posted if each.id != "4"}
    found = mirror.latest(9, Run("run", 90.0))
    assert [(each.id, each.agent, each.time, each.data) for each in found] == [
        ("3", 4, 103.0, b"3"),
        ("1", 4, 11.0, b"1"),
        ("0", 4, 100.0, b"0"),
    ]
    assert [each.id for each in mirror.latest(1, Run("run", 90.0))] == ["3"]
    # The newest that is missing comes first, unless it was given up.
    assert mirror._next_missing() == posted(4)
    mirror._given_up.add(posted(4))
    assert mirror._next_missing() is None
    del mirror._files[posted(2, "other")]
    assert mirror._next_missing() == posted(2, "other")
    mirror._newest = 2
    assert mirror._next_missing() is None

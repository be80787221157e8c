"""What the accounts of pursuer and agents do about each piece of news, without a server."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import nio
import numpy as np
import pytest

from sightfield.hardware_io.social import accounts, matrix_network, pursuer_account
from sightfield.hardware_io.social.accounts import (
    Account,
    AgentAccount,
    ServerRefusal,
    SocialDirectory,
    check_accounts,
    make_directory,
)
from sightfield.hardware_io.social.common_agents import AlbumKeeper, CommonAgents
from sightfield.hardware_io.social.matrix_client import Membership, memberships
from sightfield.hardware_io.social.matrix_network import MatrixNetwork
from sightfield.hardware_io.social.pursuer_account import PursuerAccount, Run
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import OwnAcceptance, Temperaments
from sightfield.systems.numerics.social.network.interface import (
    Answer,
    NotFriends,
    Picture,
    Response,
)

PURSUER, OWNER = "@p:maze.test", "@a:maze.test"


def done(work):
    """What work comes to; in a thread of its own: Playwright leaves a loop running in this one."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work).result()


def member(user, sender, state):
    event = nio.RoomMemberEvent.__new__(nio.RoomMemberEvent)
    event.state_key, event.sender, event.membership = user, sender, state
    return event


def room(*events):
    return SimpleNamespace(state=[], timeline=SimpleNamespace(events=list(events)))


def news(**rooms):
    return SimpleNamespace(
        rooms=SimpleNamespace(**{"invite": {}, "leave": {}, "join": {}, **rooms})
    )


@pytest.fixture
def account(monkeypatch):
    """A pursuer's account with two albums; what it does, and may not do, is kept."""
    made = PursuerAccount.__new__(PursuerAccount)
    made._user, made._albums = PURSUER, ("!0", "!1")
    made._agents = {"!0": 0, "!1": 1}
    made._lock, made.informed = threading.Lock(), threading.Event()
    made._asked, made._friends, made._invited = set(), set(), set()
    made._parting, made._due, made._responses = set(), set(), []
    made.taken, made.errands, made.done, made.refused = [], [], [], set()

    async def take(info):
        made.taken.append(info)

    made._mirrors = [SimpleNamespace(take=take)] * 2
    made._mailbox = SimpleNamespace(put=made.errands.append, waiting=3)

    async def persist(call, what):
        await call()
        if made.done[-1] in made.refused:
            raise ServerRefusal(what)

    def act(name):
        async def call(album):
            made.done.append((name, album))

        return call

    names = {"room_knock": "knock", "join": "join", "room_leave": "leave"}
    made._client = SimpleNamespace(**{name: act(told) for name, told in names.items()})
    monkeypatch.setattr(pursuer_account, "persist", persist)

    def work_off():
        while made.errands:
            done(made.errands.pop(0)())
        return made.done

    made.work_off = work_off
    return made


def test_a_request_is_a_knock_and_a_welcome_makes_a_friend(account):
    account.request(1)
    account.request(1)
    assert len(account.errands) == 1
    assert account.work_off() == [("knock", "!1")]
    assert account._asked == {1}
    done(account._take(news(invite={"!1": None, "!9": None})))
    assert account.work_off() == [("knock", "!1"), ("join", "!1")]
    own = room(member(PURSUER, OWNER, "join"))
    done(account._take(news(join={"!1": own, "!9": own})))
    assert account.friends() == {1}
    assert account.taken == [own]
    assert account.responses() == [Response(agent=1, answer=Answer.ACCEPTED)]
    assert account.responses() == []
    # Who is a friend is not asked again, nor told twice.
    account.request(1)
    done(account._take(news(join={"!1": own})))
    assert (account.work_off()[2:], account.responses(), account._asked) == ([], [], set())


def test_an_invitation_that_nobody_asked_for_is_left(account):
    done(account._take(news(invite={"!0": None})))
    assert account.work_off() == [("leave", "!0")]


def test_what_is_withdrawn_is_left_and_its_answers_are_forgotten(account):
    account._friends, account._asked = {0}, {0}
    account._responses = [
        Response(agent=0, answer=Answer.ACCEPTED),
        Response(agent=1, answer=Answer.REJECTED),
    ]
    account.withdraw(0)
    assert (account.friends(), account._asked) == (frozenset(), set())
    assert account.work_off() == [("leave", "!0")]
    assert account.responses() == [Response(agent=1, answer=Answer.REJECTED)]
    # Asked for again meanwhile, it is left and knocked at.
    account.withdraw(1)
    account.request(1)
    assert account.work_off()[1:] == [("leave", "!1"), ("knock", "!1")]


def test_who_may_not_knock_joins_and_who_may_not_do_either_is_rejected(account):
    account.refused = {("knock", "!0")}
    account.request(0)
    assert account.work_off() == [("knock", "!0"), ("join", "!0")]
    assert account.responses() == []
    account.refused = {("knock", "!1"), ("join", "!1")}
    account.request(1)
    assert account.work_off()[2:] == [("knock", "!1"), ("join", "!1")]
    assert account.responses() == [Response(agent=1, answer=Answer.REJECTED)]
    assert account._asked == {0}


def test_leavings_are_told_once_it_is_informed_and_not_its_own(account):
    sent_away = room(member(PURSUER, OWNER, "leave"), member("@x:y", OWNER, "leave"))
    account._friends = {0}
    done(account._take(news(leave={"!0": sent_away})))
    assert (account.friends(), account.informed.is_set()) == ({0}, True)
    done(account._take(news(leave={"!0": sent_away, "!9": sent_away})))
    assert account.responses() == [Response(agent=0, answer=Answer.UNFRIENDED)]
    account._asked = {0, 1}
    done(account._take(news(leave={"!0": sent_away})))
    assert account.responses() == [Response(agent=0, answer=Answer.REJECTED)]
    own = room(member(PURSUER, PURSUER, "leave"))
    done(account._take(news(leave={"!1": own, "!0": room()})))
    assert (account.responses(), account._asked) == ([], {1})
    # Another's joining is not its own, and neither is one that it left since.
    done(account._take(news(join={"!1": room(member("@x:y", OWNER, "join"))})))
    later = room(member(PURSUER, OWNER, "join"), member(PURSUER, PURSUER, "leave"))
    done(account._take(news(join={"!1": later})))
    assert account.friends() == frozenset()
    assert len(account.taken) == 2
    assert account.waiting == 3


class Keeper:
    """An album whose visitors are said, and whose answers are kept."""

    def __init__(self, knocking=(), inside=()):
        self.states = {"knock": frozenset(knocking), "join": frozenset(inside)}
        self.answers, self.waiting = [], 2

    def visitors(self, state):
        return self.states[state]

    def let_in(self, user):
        self.answers.append(("in", user))

    def send_away(self, user):
        self.answers.append(("away", user))


def test_agents_answer_whoever_knocks_by_their_temperaments():
    agents = CommonAgents.__new__(CommonAgents)
    agents._temperaments = Temperaments(
        acceptance=OwnAcceptance((1.0, 0.0, 1.0)), unfriending=(0.0, 0.0, 1.0), rejection=(0, 1, 0)
    )
    agents._generator = np.random.default_rng(0)
    agents._keepers = [Keeper(["@b:x", "@a:x"]), Keeper(["@a:x"]), Keeper([], ["@a:x"])]
    agents.advance()
    assert [each.answers for each in agents._keepers] == [
        [("in", "@a:x"), ("in", "@b:x")],
        [("away", "@a:x")],
        [("away", "@a:x")],
    ]
    assert agents.waiting == 6
    agents._temperaments = None
    agents.advance()
    assert len(agents._keepers[0].answers) == 2


def test_an_album_knows_its_visitors_and_answers_each_once():
    keeper, errands = AlbumKeeper.__new__(AlbumKeeper), []
    keeper._user, keeper._album = OWNER, "!0"
    keeper._lock, keeper._visitors = threading.Lock(), {}
    keeper._answers = SimpleNamespace(put=errands.append, waiting=1)
    keeper._pictures = SimpleNamespace(waiting=4)
    join = room(member("@x:y", "@x:y", "knock"), member(OWNER, OWNER, "join"))
    done(keeper._take(news(join={"!0": join, "!1": room(member("@z:y", "@z:y", "knock"))})))
    done(keeper._take(news()))
    assert keeper.visitors("knock") == {"@x:y"}
    assert keeper.visitors("join") == frozenset()
    keeper.let_in("@x:y")
    assert (keeper.visitors("knock"), len(errands), keeper.waiting) == (frozenset(), 1, 5)


def network_of(**options):
    made = MatrixNetwork.__new__(MatrixNetwork)
    made._count, made._name, made._run = 2, "night", Run("night", 5.0)
    made.posted = []
    made._background = SimpleNamespace(check=lambda: None)
    made._agents = SimpleNamespace(
        waiting=2,
        advance=lambda: made.posted.append("advanced"),
        post=lambda *w: made.posted.append(w),
    )
    made._pursuer = SimpleNamespace(
        waiting=1,
        friends=lambda: frozenset({1}),
        latest=lambda *words: list(words),
        responses=list,
        informed=SimpleNamespace(wait=lambda patience: made.posted.append(patience) or False),
    )
    vars(made).update(options)
    return made


def test_a_network_passes_on_what_its_accounts_know(monkeypatch):
    clock = SimpleNamespace(now=0.0)

    def monotonic():
        clock.now += 0.1
        return clock.now

    slept = []
    times = SimpleNamespace(monotonic=monotonic, sleep=slept.append, time=lambda: 77.0)
    monkeypatch.setattr(matrix_network, "time", times)
    network = network_of()
    assert network.agents() == (0, 1)
    picture = Picture(id="x", agent=1, time=0.5, data=b"d")
    network.post(1, picture)
    network.advance(3)
    assert network.posted == [(1, picture, "night"), "advanced"]
    assert network.latest(1, 3) == [1, 3, Run("night", 5.0)]
    with pytest.raises(NotFriends):
        network.latest(0, 3)
    for wrong in (
        lambda: network.post(0, picture),
        lambda: network.post(2, picture),
        lambda: network.latest(2, 1),
        lambda: network.latest(1, -1),
        lambda: network_of(_agents=None).post(1, picture),
    ):
        with pytest.raises(InvalidInput, match="` must"):
            wrong()
    assert network.latest(1, 0)[1] == 0
    # Three wait; without agents one.
    assert not network.flush(0.55)
    assert slept == [0.02] * 5
    network._pursuer.waiting = network._agents.waiting = 0
    assert network.flush(9.0)
    assert len(slept) == 5
    network.posted.clear()
    network.begin(patience=0.35)
    assert network._run == Run("night", 77.0)
    assert network.posted == [0.05] * 4
    assert network_of(_agents=None)._waiting() == 1


def test_accounts_and_albums_are_made_as_recorded(monkeypatch, as_recorded):
    called = []

    def call(address, body=None, token=None, patience=60.0):
        called.append([address, body, token, patience])
        if body is None:
            return {"nonce": "n"}
        if "mac" in body:
            return {"user_id": f"@{body['username']}:maze.test", "access_token": "t"}
        return {"room_id": f"!{len(called)}"}

    monkeypatch.setattr(accounts, "_call", call)
    secrets = SimpleNamespace(token_urlsafe=lambda size: "p" * size)
    monkeypatch.setattr(accounts, "secrets", secrets)
    as_recorded(make_directory("http://127.0.0.1:1", "secret", 2), "directory")
    as_recorded(called, "calls")


def test_each_token_is_tried_before_a_run(monkeypatch):
    directory = SocialDirectory(
        homeserver="https://maze.test",
        pursuer=Account(user=PURSUER, token="one"),
        agents=(
            AgentAccount(user=OWNER, album="!0", token="two"),
            AgentAccount(user="@b:maze.test", album="!1"),
        ),
    )
    users, called = {"one": PURSUER, "two": OWNER}, []

    def call(address, body=None, token=None, patience=60.0):
        called.append((address.rsplit("/", 1)[1], token, patience))
        if token is not None and token not in users:
            raise ServerRefusal("unknown")
        return {"user_id": users.get(token)}

    monkeypatch.setattr(accounts, "_call", call)
    check_accounts(directory)
    assert called == [("versions", None, 10), ("whoami", "one", 60.0), ("whoami", "two", 60.0)]
    users["two"] = PURSUER
    with pytest.raises(InvalidInput, match="have the token of @a"):
        check_accounts(directory)
    del users["two"]
    with pytest.raises(InvalidInput, match="have a token for @a"):
        check_accounts(directory)


def test_memberships_are_those_of_people():
    mixed = room(SimpleNamespace(state_key="x"), member("@x:y", "@z:y", "ban"))
    assert memberships(mixed) == [Membership("@x:y", "@z:y", "ban")]

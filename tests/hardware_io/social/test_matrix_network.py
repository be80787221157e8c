"""Through a real homeserver: friends, refusals, pictures, and every kind of trouble."""

import itertools
import json
import logging
import time
import urllib.request
from dataclasses import replace

import numpy as np
import pytest

from sightfield.hardware_io.social.accounts import Account
from sightfield.hardware_io.social.matrix_network import MatrixNetwork
from sightfield.hardware_io.social.provisioning import (
    ServerRefusal,
    make_directory,
    open_album,
    register_account,
)
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import OwnAcceptance, Temperaments
from sightfield.systems.numerics.social.network.interface import Answer, NotFriends, Picture

NUMBERS = itertools.count()


def always(friending=(1.0,), unfriending=(0.0,), rejection=(0.0,)):
    return Temperaments(
        acceptance=OwnAcceptance(tuple(friending)),
        unfriending=tuple(unfriending),
        rejection=tuple(rejection),
    )


def picture(agent, number, size=2000):
    data = np.random.default_rng([agent, number]).bytes(size)
    return Picture(id=f"{agent}/{number}", agent=agent, time=number / 10, data=data)


@pytest.fixture
def directory(synapse):
    """A function of a number of agents: fresh accounts."""

    def make(agents=1):
        prefix = f"test{next(NUMBERS)}"
        return make_directory(synapse.url, synapse.secret, agents, prefix=prefix)

    return make


@pytest.fixture
def befriend(eventually):
    """A function that makes friends of agents that accept when they get to it."""

    def make(network, *agents):
        network.begin()
        for agent in agents:
            network.request(agent)

        def accepted():
            network.advance(0)
            return network.friends() >= set(agents)

        eventually(accepted)

    return make


def answers(network):
    return [(each.agent, each.answer) for each in network.responses()]


def ids(network, agent=0, count=16):
    return [each.id for each in network.latest(agent, count)]


def test_friends_read_pictures_as_they_were_posted_and_nobody_else_does(
    directory, befriend, eventually, synapse
):
    accounts = directory(2)
    with MatrixNetwork(accounts, always((1.0, 1.0), (0.0, 0.0), (0.0, 0.0))) as network:
        befriend(network, 0)
        assert answers(network) == [(0, Answer.ACCEPTED)]
        for number in range(3):
            network.post(0, picture(0, number))
            network.post(1, picture(1, number))
        assert network.flush(30)
        eventually(lambda: len(network.latest(0, 3)) == 3)
        assert network.latest(0, 2) == [picture(0, 2), picture(0, 1)]
        with pytest.raises(NotFriends):
            network.latest(1, 1)
    # The server keeps it so, not only this program.
    for agent, code in ((0, 200), (1, 403)):
        room = accounts.agents[agent].album
        address = f"{synapse.url}/_matrix/client/v3/rooms/{room}/messages?dir=b"
        token = {"Authorization": f"Bearer {accounts.pursuer.token}"}
        try:
            urllib.request.urlopen(urllib.request.Request(address, headers=token)).close()
            got = 200
        except urllib.error.HTTPError as error:
            got = error.code
        assert got == code


def test_a_rejected_request_is_told_and_can_be_made_again(directory, eventually):
    with MatrixNetwork(directory(), always((0.0,), (0.0,), (1.0,))) as network:
        network.begin()
        for _ in range(2):
            network.request(0)
            found = []

            def rejected(found=found):
                network.advance(0)
                found += answers(network)
                return found

            eventually(rejected)
            assert found == [(0, Answer.REJECTED)]
            assert network.friends() == frozenset()


def test_silence_is_no_answer_and_a_request_withdrawn_is_off(directory, eventually, synapse):
    accounts = directory()
    with MatrixNetwork(accounts, always((0.0,))) as network:
        network.begin()
        network.request(0)
        assert network.flush(30)
        for iteration in range(5):
            network.advance(iteration)
        network.withdraw(0)
        assert network.flush(30)
    with MatrixNetwork(accounts, always((1.0,))) as network:
        network.begin()
        for iteration in range(20):
            network.advance(iteration)
            time.sleep(0.02)
        assert network.flush(30)
        assert network.responses() == []
        assert network.friends() == frozenset()


def call(synapse, method, path, body, token):
    """What any other program of an account's owner might do."""
    headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/json"}
    address = f"{synapse.url}/_matrix/client/v3/rooms/{path}"
    request = urllib.request.Request(address, json.dumps(body).encode(), headers, method=method)
    urllib.request.urlopen(request, timeout=30).close()


def test_agents_unfriend_by_their_temperament(directory, befriend, eventually):
    accounts = directory()
    with MatrixNetwork(accounts, always()) as network:
        befriend(network, 0)
    with MatrixNetwork(accounts, always((0.0,), (1.0,))) as network:
        network.begin()
        assert network.friends() == {0}

        def unfriended():
            network.advance(1)
            return not network.friends()

        eventually(unfriended)
        assert answers(network) == [(0, Answer.UNFRIENDED)]


def test_unfriending_shuts_the_album_and_the_agent_may_become_a_friend_again(
    directory, befriend, eventually, synapse
):
    accounts = directory()
    with MatrixNetwork(accounts, always()) as network:
        befriend(network, 0)
        network.post(0, picture(0, 0))
        eventually(lambda: ids(network) == ["0/0"])
        assert answers(network) == [(0, Answer.ACCEPTED)]
        agent = accounts.agents[0]
        body = {"user_id": accounts.pursuer.user}
        call(synapse, "POST", f"{agent.album}/kick", body, agent.token)
        eventually(lambda: not network.friends())
        assert answers(network) == [(0, Answer.UNFRIENDED)]
        with pytest.raises(NotFriends):
            network.latest(0, 1)
        # Posted while shut out.
        for number in range(1, 4):
            network.post(0, picture(0, number))
        assert network.flush(30)
        befriend(network, 0)
        eventually(lambda: len(ids(network)) == 4)
        assert ids(network) == ["0/3", "0/2", "0/1", "0/0"]


def test_leaving_a_friend_ends_the_friendship_without_an_answer(directory, befriend, eventually):
    with MatrixNetwork(directory(), always()) as network:
        befriend(network, 0)
        network.responses()
        network.withdraw(0)
        assert network.friends() == frozenset()
        assert network.flush(30)
        befriend(network, 0)
        assert answers(network) == [(0, Answer.ACCEPTED)]


def test_a_restart_in_mid_run_delays_everything_and_loses_nothing(
    directory, befriend, eventually, synapse
):
    with MatrixNetwork(directory(2), always((1.0, 1.0), (0.0, 0.0), (0.0, 0.0))) as network:
        befriend(network, 0)
        network.post(0, picture(0, 0))
        eventually(lambda: ids(network) == ["0/0"])
        synapse.stop()
        network.request(1)
        for number in range(1, 4):
            network.post(0, picture(0, number))
        assert not network.flush(0.5)
        network.advance(1)
        assert ids(network) == ["0/0"]
        synapse.start()
        befriend(network, 1)
        eventually(lambda: len(ids(network)) == 4)
        assert network.latest(0, 16) == [picture(0, number) for number in (3, 2, 1, 0)]
        assert network.friends() == {0, 1}


def test_a_burst_of_pictures_meets_the_rate_limit_and_arrives_in_order(
    directory, befriend, eventually, caplog
):
    caplog.set_level(logging.INFO, "sightfield.hardware_io.social.persistence")
    with MatrixNetwork(directory(), always()) as network:
        befriend(network, 0)
        for number in range(14):
            network.post(0, picture(0, number))
        assert network.flush(60)
        assert "M_LIMIT_EXCEEDED" in caplog.text
        eventually(lambda: len(ids(network)) == 14)
        assert ids(network) == [f"0/{number}" for number in reversed(range(14))]


def test_a_half_uploaded_picture_is_uploaded_again_and_posted_once(
    directory, befriend, eventually, line
):
    accounts = replace(directory(), homeserver=line.url)
    with MatrixNetwork(accounts, always()) as network:
        befriend(network, 0)
        line.cut_after = 100_000
        network.post(0, picture(0, 0, size=300_000))
        network.post(0, picture(0, 1))
        assert network.flush(60)
        assert line.breaks == 1
        eventually(lambda: len(ids(network)) == 2)
        assert network.latest(0, 2) == [picture(0, 1), picture(0, 0, size=300_000)]


def test_no_call_waits_for_a_slow_server(directory, befriend, eventually, line):
    accounts = replace(directory(), homeserver=line.url)
    with MatrixNetwork(accounts, always()) as network:
        line.delay = 0.2
        befriend(network, 0)
        line.delay = 3.0
        network.post(0, picture(0, 0))
        network.withdraw(0)
        network.request(0)
        network.advance(0)
        network.responses()
        assert network.friends() == frozenset()
        assert not network.flush(0)
        line.delay = 0.0
        befriend(network, 0)
        eventually(lambda: ids(network) == ["0/0"])


def test_pictures_in_the_outbox_survive_the_program(
    directory, befriend, eventually, synapse, tmp_path
):
    accounts = directory()
    unreachable = replace(accounts, homeserver="http://127.0.0.1:9")
    with MatrixNetwork(unreachable, always(), outbox=tmp_path) as network:
        network.begin(patience=0.1)
        for number in range(2):
            network.post(0, picture(0, number))
    with MatrixNetwork(accounts, always(), outbox=tmp_path) as network:
        befriend(network, 0)
        network.post(0, picture(0, 2))
        eventually(lambda: len(ids(network)) == 3)
        assert network.latest(0, 3) == [picture(0, number) for number in (2, 1, 0)]
        assert network.flush(30)
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]


def test_a_new_program_finds_its_friends_and_their_pictures(directory, befriend, eventually):
    accounts = directory()
    with MatrixNetwork(accounts, always()) as network:
        befriend(network, 0)
        network.post(0, picture(0, 0))
        assert network.flush(30)
    with MatrixNetwork(accounts, run_agents=False) as network:
        network.begin()
        assert network.friends() == {0}
        assert network.responses() == []
        eventually(lambda: network.latest(0, 1) == [picture(0, 0)])
        with pytest.raises(InvalidInput, match="`run_agents`"):
            network.post(0, picture(0, 1))


def test_whatever_else_is_in_an_album_does_not_keep_the_pictures_back(
    directory, befriend, eventually, synapse
):
    accounts = directory()
    agent = accounts.agents[0]
    with MatrixNetwork(accounts, always()) as network:
        befriend(network, 0)
        for number, body in enumerate(
            (
                {"msgtype": "m.text", "body": "hello"},
                {"msgtype": "m.image", "body": "no address"},
                {"msgtype": "m.image", "body": "elsewhere", "url": "https://example.org/x.png"},
                {"msgtype": "m.image", "body": "missing", "url": "mxc://maze.test/missing"},
            )
        ):
            path = f"{agent.album}/send/m.room.message/other{number}"
            call(synapse, "PUT", path, body, agent.token)
        network.post(0, picture(0, 0))
        eventually(lambda: network.latest(0, 3) == [picture(0, 0)])


def test_a_token_that_the_server_does_not_take_is_said_in_one_line(directory):
    accounts = directory()
    wrong = replace(accounts, pursuer=replace(accounts.pursuer, token="wrong"))
    with (
        MatrixNetwork(wrong, always()) as network,
        pytest.raises(ServerRefusal, match=r"the homeserver refuses to .*M_UNKNOWN_TOKEN"),
    ):
        network.begin()


def test_an_account_is_not_made_with_a_wrong_secret_or_without_a_server(synapse):
    with pytest.raises(ServerRefusal, match="403"):
        register_account(synapse.url, "not the secret", "nobody")
    with pytest.raises(ServerRefusal, match="does not answer"):
        open_album("http://127.0.0.1:9", Account(user="@a:b", token="t"))


def test_agents_without_tokens_or_of_another_number_cannot_be_run(directory):
    accounts = directory()
    bare = replace(accounts, agents=(replace(accounts.agents[0], token=None),))
    with pytest.raises(InvalidInput, match="`agents` must have tokens"):
        MatrixNetwork(bare)
    with pytest.raises(InvalidInput, match="`temperaments`"):
        MatrixNetwork(accounts, always((1.0, 1.0), (0.0, 0.0), (0.0, 0.0)))

"""Through a real homeserver: trouble delays the pursuer, and loses nothing."""

import logging
from dataclasses import replace

import pytest

from sightfield.hardware_io.social.accounts import (
    Account,
    ServerRefusal,
    open_album,
    register_account,
)
from sightfield.hardware_io.social.matrix_network import MatrixNetwork
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.interface import Answer


def test_a_restart_in_mid_run_delays_everything_and_loses_nothing(maze):
    with MatrixNetwork(
        maze.directory(2), maze.always((1.0, 1.0), (0.0, 0.0), (0.0, 0.0))
    ) as network:
        maze.befriend(network, 0)
        network.post(0, maze.picture(0, 0))
        maze.eventually(lambda: maze.ids(network) == ["0/0"])
        with maze.synapse.down():
            network.request(1)
            for number in range(1, 4):
                network.post(0, maze.picture(0, number))
            assert not network.flush(0.5)
            network.advance(1)
            assert maze.ids(network) == ["0/0"]
        maze.befriend(network, 1)
        maze.eventually(lambda: len(maze.ids(network)) == 4)
        assert network.latest(0, 16) == [maze.picture(0, number) for number in (3, 2, 1, 0)]
        assert network.friends() == {0, 1}


def test_requests_that_come_and_go_while_the_server_is_away_do_not_pile_up(maze, line):
    accounts = replace(maze.directory(), homeserver=line.url)
    with MatrixNetwork(accounts, maze.always()) as network:
        network.begin()
        with maze.synapse.down():
            for _ in range(200):
                network.request(0)
                network.withdraw(0)
            network.request(0)
        maze.befriend(network, 0)
        assert network.flush(5)
        assert maze.answers(network) == [(0, Answer.ACCEPTED)]


def test_a_burst_of_pictures_meets_the_rate_limit_and_arrives_in_order(maze, caplog):
    caplog.set_level(logging.INFO, "sightfield.hardware_io.social.matrix_client")
    with MatrixNetwork(maze.directory(), maze.always()) as network:
        maze.befriend(network, 0)
        for number in range(14):
            network.post(0, maze.picture(0, number))
        assert network.flush(60)
        assert "M_LIMIT_EXCEEDED" in caplog.text
        maze.eventually(lambda: len(maze.ids(network)) == 14)
        assert maze.ids(network) == [f"0/{number}" for number in reversed(range(14))]


def test_a_half_uploaded_picture_is_uploaded_again_and_posted_once(maze, line):
    accounts = replace(maze.directory(), homeserver=line.url)
    with MatrixNetwork(accounts, maze.always()) as network:
        maze.befriend(network, 0)
        line.cut_after = 100_000
        network.post(0, maze.picture(0, 0, size=300_000))
        network.post(0, maze.picture(0, 1))
        assert network.flush(60)
        assert line.breaks == 1
        maze.eventually(lambda: len(maze.ids(network)) == 2)
        assert network.latest(0, 2) == [maze.picture(0, 1), maze.picture(0, 0, size=300_000)]


def test_no_call_waits_for_a_slow_server(maze, line):
    accounts = replace(maze.directory(), homeserver=line.url)
    with MatrixNetwork(accounts, maze.always()) as network:
        line.delay = 0.2
        maze.befriend(network, 0)
        line.delay = 3.0
        network.post(0, maze.picture(0, 0))
        network.withdraw(0)
        network.request(0)
        network.advance(0)
        network.responses()
        assert network.friends() == frozenset()
        assert not network.flush(0)
        line.delay = 0.0
        maze.befriend(network, 0)
        maze.eventually(lambda: maze.ids(network) == ["0/0"])


def test_pictures_in_the_outbox_survive_the_program(maze, tmp_path):
    accounts = maze.directory()
    unreachable = replace(accounts, homeserver="http://127.0.0.1:9")
    with MatrixNetwork(unreachable, maze.always(), outbox=tmp_path, run="one") as network:
        network.begin(patience=0.1)
        for number in range(2):
            network.post(0, maze.picture(0, number))
    with MatrixNetwork(accounts, maze.always(), outbox=tmp_path, run="one") as network:
        maze.befriend(network, 0)
        network.post(0, maze.picture(0, 2))
        maze.eventually(lambda: len(maze.ids(network)) == 3)
        assert network.latest(0, 3) == [maze.picture(0, number) for number in (2, 1, 0)]
        assert network.flush(30)
    assert not [file for file in tmp_path.rglob("*") if file.is_file()]


def test_whatever_else_is_in_an_album_does_not_keep_the_pictures_back(maze):
    accounts = maze.directory()
    agent = accounts.agents[0]
    with MatrixNetwork(accounts, maze.always()) as network:
        maze.befriend(network, 0)
        for number, body in enumerate(
            (
                {"msgtype": "m.text", "body": "hello"},
                {"msgtype": "m.image", "body": "no address"},
                {"msgtype": "m.image", "body": "elsewhere", "url": "https://example.org/x.png"},
                {"msgtype": "m.image", "body": "missing", "url": "mxc://maze.test/missing"},
            )
        ):
            path = f"{agent.album}/send/m.room.message/other{number}"
            maze.call("PUT", path, body, agent.token)
        network.post(0, maze.picture(0, 0))
        maze.eventually(lambda: network.latest(0, 3) == [maze.picture(0, 0)])


def test_a_token_that_the_server_does_not_take_is_said_in_one_line(maze):
    accounts = maze.directory()
    wrong = replace(accounts, pursuer=replace(accounts.pursuer, token="wrong"))
    with (
        MatrixNetwork(wrong, maze.always()) as network,
        pytest.raises(ServerRefusal, match=r"the homeserver refuses to .*M_UNKNOWN_TOKEN"),
    ):
        network.begin()


def test_an_account_is_not_made_with_a_wrong_secret_or_without_a_server(maze):
    with pytest.raises(ServerRefusal, match="403"):
        register_account(maze.synapse.url, "not the secret", "nobody")
    with pytest.raises(ServerRefusal, match="does not answer"):
        open_album("http://127.0.0.1:9", Account(user="@a:b", token="t"))


def test_agents_without_tokens_or_of_another_number_cannot_be_run(maze):
    accounts = maze.directory()
    bare = replace(accounts, agents=(replace(accounts.agents[0], token=None),))
    with pytest.raises(InvalidInput, match="`agents` must have tokens"):
        MatrixNetwork(bare)
    with pytest.raises(InvalidInput, match="`temperaments`"):
        MatrixNetwork(accounts, maze.always((1.0, 1.0), (0.0, 0.0), (0.0, 0.0)))

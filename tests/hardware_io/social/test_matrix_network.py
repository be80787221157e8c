"""Through a real homeserver: friends, refusals, and pictures that only friends read."""

import json
import time
import urllib.error
import urllib.request
from dataclasses import replace

import pytest

from sightfield.hardware_io.social.matrix_network import MatrixNetwork
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.interface import Answer, NotFriends


def test_friends_read_pictures_as_they_were_posted_and_nobody_else_does(maze):
    accounts = maze.directory(2)
    with MatrixNetwork(accounts, maze.always((1.0, 1.0), (0.0, 0.0), (0.0, 0.0))) as network:
        maze.befriend(network, 0)
        assert maze.answers(network) == [(0, Answer.ACCEPTED)]
        for number in range(3):
            network.post(0, maze.picture(0, number))
            network.post(1, maze.picture(1, number))
        assert network.flush(30)
        maze.eventually(lambda: len(network.latest(0, 3)) == 3)
        assert network.latest(0, 2) == [maze.picture(0, 2), maze.picture(0, 1)]
        with pytest.raises(NotFriends):
            network.latest(1, 1)
    # The server keeps it so, not only this program.
    for agent, code in ((0, 200), (1, 403)):
        room = accounts.agents[agent].album
        address = f"{maze.synapse.url}/_matrix/client/v3/rooms/{room}/messages?dir=b"
        token = {"Authorization": f"Bearer {accounts.pursuer.token}"}
        try:
            urllib.request.urlopen(urllib.request.Request(address, headers=token)).close()
            got = 200
        except urllib.error.HTTPError as error:
            got = error.code
        assert got == code


def test_a_rejected_request_is_told_and_can_be_made_again(maze):
    with MatrixNetwork(maze.directory(), maze.always((0.0,), (0.0,), (1.0,))) as network:
        network.begin()
        for _ in range(2):
            network.request(0)
            found = []

            def rejected(found=found):
                network.advance(0)
                found += maze.answers(network)
                return found

            maze.eventually(rejected)
            assert found == [(0, Answer.REJECTED)]
            assert network.friends() == frozenset()


def test_silence_is_no_answer_and_a_request_withdrawn_is_off(maze):
    accounts = maze.directory()
    with MatrixNetwork(accounts, maze.always((0.0,))) as network:
        network.begin()
        network.request(0)
        assert network.flush(30)
        for iteration in range(5):
            network.advance(iteration)
        network.withdraw(0)
        assert network.flush(30)
    with MatrixNetwork(accounts, maze.always((1.0,))) as network:
        network.begin()
        for iteration in range(20):
            network.advance(iteration)
            time.sleep(0.02)
        assert network.flush(30)
        assert network.responses() == []
        assert network.friends() == frozenset()


def test_a_friend_left_by_another_program_of_the_pursuer_is_told_as_the_end_of_a_friendship(maze):
    """So that nobody takes it for a friend for ever: a withdrawal can cross its acceptance."""
    accounts = maze.directory()
    with MatrixNetwork(accounts, maze.always()) as network:
        maze.befriend(network, 0)
        maze.call("POST", f"{accounts.agents[0].album}/leave", {}, accounts.pursuer.token)
        maze.eventually(lambda: not network.friends())
        assert maze.answers(network) == [(0, Answer.ACCEPTED), (0, Answer.UNFRIENDED)]


def test_agents_unfriend_by_their_temperament(maze):
    accounts = maze.directory()
    with MatrixNetwork(accounts, maze.always()) as network:
        maze.befriend(network, 0)
    with MatrixNetwork(accounts, maze.always((0.0,), (1.0,))) as network:
        network.begin()
        assert network.friends() == {0}

        def unfriended():
            network.advance(1)
            return not network.friends()

        maze.eventually(unfriended)
        assert maze.answers(network) == [(0, Answer.UNFRIENDED)]


def test_unfriending_shuts_the_album_and_the_agent_may_become_a_friend_again(maze):
    accounts = maze.directory()
    with MatrixNetwork(accounts, maze.always()) as network:
        maze.befriend(network, 0)
        network.post(0, maze.picture(0, 0))
        maze.eventually(lambda: maze.ids(network) == ["0/0"])
        assert maze.answers(network) == [(0, Answer.ACCEPTED)]
        agent = accounts.agents[0]
        body = {"user_id": accounts.pursuer.user}
        maze.call("POST", f"{agent.album}/kick", body, agent.token)
        maze.eventually(lambda: not network.friends())
        assert maze.answers(network) == [(0, Answer.UNFRIENDED)]
        with pytest.raises(NotFriends):
            network.latest(0, 1)
        # Posted while shut out.
        for number in range(1, 4):
            network.post(0, maze.picture(0, number))
        assert network.flush(30)
        maze.befriend(network, 0)
        maze.eventually(lambda: len(maze.ids(network)) == 4)
        assert maze.ids(network) == ["0/3", "0/2", "0/1", "0/0"]


def test_leaving_a_friend_ends_the_friendship_without_an_answer(maze):
    with MatrixNetwork(maze.directory(), maze.always()) as network:
        maze.befriend(network, 0)
        network.responses()
        network.withdraw(0)
        assert network.friends() == frozenset()
        assert network.flush(30)
        maze.befriend(network, 0)
        assert maze.answers(network) == [(0, Answer.ACCEPTED)]


def test_a_run_that_goes_on_in_another_program_finds_its_friends_and_pictures(maze):
    accounts = maze.directory()
    with MatrixNetwork(accounts, maze.always(), run="one") as network:
        maze.befriend(network, 0)
        network.post(0, maze.picture(0, 0))
        assert network.flush(30)
    with MatrixNetwork(accounts, run="one", run_agents=False) as network:
        network.begin()
        assert network.friends() == {0}
        assert network.responses() == []
        maze.eventually(lambda: network.latest(0, 1) == [maze.picture(0, 0)])
        with pytest.raises(InvalidInput, match="`run_agents`"):
            network.post(0, maze.picture(0, 1))


def test_a_new_run_starts_with_an_empty_album_and_the_same_names(maze):
    with MatrixNetwork(maze.directory(), maze.always()) as network:
        maze.befriend(network, 0)
        network.post(0, maze.picture(0, 0))
        maze.eventually(lambda: maze.ids(network) == ["0/0"])
        network.begin()
        assert network.friends() == {0}
        assert maze.ids(network) == []
        again = replace(maze.picture(0, 0), data=b"other")
        network.post(0, again)
        maze.eventually(lambda: network.latest(0, 2) == [again])


def test_a_picture_from_another_program_has_the_time_since_the_run_began(maze):
    accounts = maze.directory()
    agent = accounts.agents[0]
    with MatrixNetwork(accounts, maze.always()) as network:
        maze.befriend(network, 0)
        network.begin()
        address = f"{maze.synapse.url}/_matrix/media/v3/upload"
        headers = {"Authorization": f"Bearer {agent.token}", "Content-Type": "image/png"}
        request = urllib.request.Request(address, b"from a telephone", headers)
        with urllib.request.urlopen(request, timeout=30) as answer:
            url = json.load(answer)["content_uri"]
        body = {"msgtype": "m.image", "body": "photo.png", "url": url}
        maze.call("PUT", f"{agent.album}/send/m.room.message/photo", body, agent.token)
        maze.eventually(lambda: network.latest(0, 1))
        (found,) = network.latest(0, 1)
        assert found.data == b"from a telephone"
        assert 0 <= found.time < 60

"""A server to try a search on, and what is said where a server or an account is none."""

import json
import os
import signal
import socket
import stat
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from sightfield.diagrams.commands.app import main
from sightfield.hardware_io.social.accounts import check_accounts, load_directory, save_directory
from sightfield.hardware_io.social.local_server import LocalServer
from sightfield.systems.numerics.errors import InvalidInput

SIGHTFIELD = Path(sys.executable).with_name("sightfield")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def refusal(monkeypatch, capsys):
    """A function that runs the command in this process: what it said as it refused."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["sightfield", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr().err
        assert ended.value.code == 2
        assert len(said.strip().splitlines()) == 1
        return said

    return run


def test_accounts_that_the_server_knows_pass(maze):
    check_accounts(maze.directory(1))


def test_a_token_that_the_server_refuses_is_named_in_one_line(maze):
    good = maze.directory(1)
    for wrong in (
        replace(good, pursuer=replace(good.pursuer, token="wrong")),
        replace(good, agents=(replace(good.agents[0], token="wrong"),)),
    ):
        with pytest.raises(
            InvalidInput, match=r"must have a token for @.* that the server takes"
        ) as e:
            check_accounts(wrong)
        assert "\n" not in str(e.value)


def test_a_token_of_another_account_is_refused(maze):
    good = maze.directory(1)
    swapped = replace(good, pursuer=replace(good.pursuer, token=good.agents[0].token))
    with pytest.raises(InvalidInput, match="`accounts` must have the token of @"):
        check_accounts(swapped)


def test_a_search_without_its_server_is_one_line_and_exit_code_2(maze, refusal, tmp_path):
    accounts = tmp_path / "accounts.yaml"
    gone = replace(maze.directory(3), homeserver=f"http://127.0.0.1:{free_port()}")
    save_directory(gone, accounts)
    said = refusal("social", "--network", "matrix", "--accounts", accounts)
    assert "`homeserver` must be a Matrix server that answers; got http" in said
    elsewhere = ("--homeserver", "http://matrix.example.org")
    said = refusal("social", "--network", "matrix", "--accounts", accounts, *elsewhere)
    assert "must be https:// but for a server on this machine" in said


def open_server(accounts):
    """`sightfield social server` for two agents, once it is up, and what it said."""
    command = [SIGHTFIELD, "social", "server", "--port", str(free_port()), "--accounts", accounts]
    server = subprocess.Popen(
        [*command, "--agents", "2"],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    assert server.stdout is not None
    said = []
    while "Ctrl-C ends it" not in "".join(said[-1:]) and server.poll() is None:
        said.append(server.stdout.readline())
    return server, said


def test_a_server_to_try_makes_accounts_and_forgets_them_at_its_end(tmp_path):
    accounts = tmp_path / "accounts.yaml"
    server, said = open_server(accounts)
    try:
        assert f"sightfield social --network matrix --accounts {accounts}\n" in said
        assert stat.S_IMODE(accounts.stat().st_mode) == 0o600
        directory = load_directory(accounts)
        assert len(directory.agents) == 2
        check_accounts(directory)
    finally:
        # As a terminal does that is closed; Ctrl-C is the same.
        server.send_signal(signal.SIGHUP)
    assert server.wait(30) == 0
    assert not accounts.exists()
    with pytest.raises(InvalidInput, match="that answers"):
        check_accounts(directory)


def test_synapse_ends_with_a_server_that_is_killed(tmp_path):
    server, _ = open_server(tmp_path / "accounts.yaml")
    directory = load_directory(tmp_path / "accounts.yaml")
    server.kill()
    server.wait()
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        try:
            check_accounts(directory)
        except InvalidInput:
            return
        time.sleep(0.2)
    pytest.fail("Synapse is still there")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--agents", 0), "`--agents` must be at least 1; got 0"),
        (("--port", 80), "`--port` must be from 1024 to 65535; got 80"),
        (("--accounts", "."), "`--accounts` must be a new file"),
        (("--accounts", "no/folder.yaml"), "must be a new file; got no/folder.yaml (No such file"),
    ],
)
def test_bad_input_is_one_line(arguments, message, refusal):
    assert message in refusal("social", "server", *arguments)


def test_without_synapse_the_server_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "synapse", None)
    with pytest.raises(
        InvalidInput, match=r"pip install '\.\[social-server\]' in .*; not installed: synapse"
    ):
        LocalServer(tmp_path, 8008)


def test_a_port_that_something_has_is_refused(synapse, tmp_path):
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        for port in (synapse.port, silent.getsockname()[1]):
            folder = tmp_path / str(port)
            folder.mkdir()
            second = LocalServer(folder, port)
            with pytest.raises(InvalidInput, match="`--port` must be free"):
                second.start()


def test_what_makes_accounts_is_for_the_user_alone(tmp_path):
    server = LocalServer(tmp_path, free_port())
    config = tmp_path / "homeserver.yaml"
    assert stat.S_IMODE(config.stat().st_mode) == 0o600
    kept = yaml.safe_load(config.read_text())
    assert kept == json.loads(config.read_text())
    assert kept["registration_shared_secret"] == server.secret
    assert [each["bind_addresses"] for each in kept["listeners"]] == [["127.0.0.1"]]

"""A directory of accounts survives its file, and a wrong one is told in one line."""

import stat

import pytest

from sightfield.hardware_io.social.accounts import (
    Account,
    AgentAccount,
    SocialDirectory,
    load_directory,
    save_directory,
)
from sightfield.systems.numerics.errors import InvalidInput


def directory(**changes):
    fields = {
        "homeserver": "http://127.0.0.1:8008",
        "pursuer": Account(user="@pursuer:maze.test", token="p"),
        "agents": (
            AgentAccount(user="@a:maze.test", album="!a:maze.test", token="t"),
            AgentAccount(user="@b:maze.test", album="!b:maze.test"),
        ),
    }
    return SocialDirectory(**(fields | changes))


def test_a_directory_comes_back_from_its_file_which_only_its_owner_reads(tmp_path):
    path = tmp_path / "accounts.yaml"
    save_directory(directory(), path)
    assert load_directory(path) == directory()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    save_directory(directory(agents=()), path)
    assert load_directory(path).agents == ()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[1, 2]",
        "homeserver: http://x",
        "{",
        "homeserver: http://x\npursuer: {user: '@p:x', token: t}\nagents: [{user: '@a:x'}]",
        "homeserver: http://x\npursuer: {user: '@p:x', token: t, more: 1}\nagents: []",
        "homeserver: 3\npursuer: {user: '@p:x', token: t}\nagents: []",
        "[" * 10_000,
        "homeserver: 2024-99-99",
    ],
)
def test_a_file_that_is_no_directory_is_refused(text, tmp_path):
    path = tmp_path / "accounts.yaml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match="`accounts` must be a file of accounts") as caught:
        load_directory(path)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_or_has_no_end_is_refused(tmp_path):
    for path in (tmp_path / "none.yaml", "/dev/zero"):
        with pytest.raises(InvalidInput, match="`accounts`"):
            load_directory(path)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: Account(user="pursuer", token="t"), "user"),
        (lambda: Account(user="@p:x", token=""), "token"),
        (lambda: AgentAccount(user="@a:x", album="a"), "album"),
        (lambda: directory(homeserver="matrix.org"), "homeserver"),
        (lambda: directory(agents=(AgentAccount(user="@a:x", album="!a"),) * 2), "agents"),
    ],
)
def test_what_is_no_account_is_refused(make, name):
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        make()


def test_a_file_that_others_may_read_is_refused(tmp_path):
    path = tmp_path / "accounts.yaml"
    save_directory(directory(), path)
    for mode in (0o644, 0o640, 0o602):
        path.chmod(mode)
        with pytest.raises(InvalidInput, match=f"`accounts` must be readable by you .* {mode:o}$"):
            load_directory(path)


@pytest.mark.parametrize(
    "address",
    [
        "http://matrix.example.org",
        "http://10.0.0.7:8008",
        "http://127.0.0.1.example.org",
        "http://",
    ],
)
def test_tokens_do_not_go_over_the_network_for_all_to_read(address):
    with pytest.raises(
        InvalidInput, match="`homeserver` must be https:// but for a server on this"
    ):
        directory(homeserver=address)


@pytest.mark.parametrize(
    "address", ["https://x.org", "http://localhost:8008", "http://[::1]:8008", "http://127.0.0.1:1"]
)
def test_what_stays_on_this_machine_may_be_plain(address):
    assert directory(homeserver=address).homeserver == address

"""Accounts and albums on a homeserver: their file, and how they are made there once.

A file of the accounts of the pursuer and of the common agents is YAML::

    homeserver: https://matrix.example.org
    pursuer: {user: "@pursuer:example.org", token: ...}
    agents:
      - {user: "@agent0:example.org", album: "!room:example.org", token: ...}

An agent's token is needed only where this program posts and answers for it.

Accounts are registered with the server's shared secret, as Synapse's own command does; on a server
without one they are made by hand. An album is a private room: anyone may knock, only its owner
invites, removes and posts, and members read all of it, including earlier pictures.
"""

import hashlib
import hmac
import http.client
import json
import os
import secrets
import stat
import urllib.error
import urllib.request
from dataclasses import asdict, dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import yaml

from ...systems.numerics.errors import InvalidInput, SightfieldError, require
from ...systems.numerics.files import read_yaml


@dataclass(frozen=True, kw_only=True)
class Account:
    """The pursuer's account.

    Attributes:
        user: Its name, "@name:server".
        token: Its access token.

    Raises:
        InvalidInput: The name is not a full name, or the token is empty.
    """

    user: str
    token: str

    def __post_init__(self):
        _require_user(self.user)
        require(bool(self.token), "token", f"be given for {self.user}", repr(self.token))


@dataclass(frozen=True, kw_only=True)
class AgentAccount:
    """A common agent's account.

    Attributes:
        user: Its name, "@name:server".
        album: The room of its pictures, "!room".
        token: Its access token; None if the agent is not run by this program.

    Raises:
        InvalidInput: The name is not a full name, or the album is not a room's id.
    """

    user: str
    album: str
    token: str | None = None

    def __post_init__(self):
        _require_user(self.user)
        require(self.album.startswith("!"), "album", "be a room's id, !room", self.album)


@dataclass(frozen=True, kw_only=True)
class SocialDirectory:
    """All accounts on one homeserver; agents are numbered from 0 in their order.

    Attributes:
        homeserver: Its address, http:// or https://.
        pursuer: The one account that makes friends.
        agents: The common agents.

    Raises:
        InvalidInput: The address is not http:// or https://, is plain http:// to another machine,
            or two agents share an account or an album.
    """

    homeserver: str
    pursuer: Account
    agents: tuple[AgentAccount, ...]

    def __post_init__(self):
        address = self.homeserver.startswith(("http://", "https://"))
        require(address, "homeserver", "begin with http:// or https://", self.homeserver)
        # Over plain http, tokens and pictures could be read by anyone on the network.
        plain = self.homeserver.startswith("http://") and not _is_here(self.homeserver)
        wish = "be https:// but for a server on this machine"
        require(not plain, "homeserver", wish, self.homeserver)
        for name in ("user", "album"):
            values = [getattr(agent, name) for agent in self.agents]
            require(len(set(values)) == len(values), "agents", f"differ in `{name}`", values)


def load_directory(path: str | Path) -> SocialDirectory:
    """Read a directory from a YAML file.

    Raises:
        InvalidInput: The file cannot be read, is not such a directory, or others may read it.
    """
    path = Path(path)
    try:
        mode = path.stat().st_mode
        # A device has no end.
        require(stat.S_ISREG(mode) or stat.S_ISDIR(mode), "accounts", "be a file of accounts", path)
        content: Any = read_yaml(path.read_text(encoding="utf-8"))
        found = SocialDirectory(
            homeserver=content["homeserver"],
            pursuer=Account(**content["pursuer"]),
            agents=tuple(AgentAccount(**agent) for agent in content["agents"]),
        )
    except InvalidInput:
        raise
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError, AttributeError) as e:
        what = " ".join(str(e).split())
        raise InvalidInput(f"`accounts` must be a file of accounts; got {path}: {what}") from None
    wish = f"be readable by you alone, as it holds tokens: chmod 600 {path}"
    require(not mode & 0o077, "accounts", wish, f"mode {stat.S_IMODE(mode):o}")
    return found


def save_directory(directory: SocialDirectory, path: str | Path) -> None:
    """Write a directory as YAML, readable by its owner alone: it holds tokens."""
    content = asdict(directory) | {"agents": [asdict(agent) for agent in directory.agents]}
    new = Path(path).with_name(Path(path).name + ".new")
    with open(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
        yaml.safe_dump(content, file, sort_keys=False)
    new.replace(path)


def _is_here(address: str) -> bool:
    """Whether an address is localhost or a loopback address, without asking a name server."""
    try:
        host = urlsplit(address).hostname or ""
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _require_user(user: str) -> None:
    whole = user.startswith("@") and ":" in user
    require(whole, "user", "be a full name, @name:server", user)


class ServerRefusal(SightfieldError):
    """A homeserver refuses for good: trying again would not help."""


def register_account(homeserver: str, secret: str, name: str) -> Account:
    """Make an account with a password that nobody knows.

    Args:
        homeserver: Its address.
        secret: `registration_shared_secret` of its configuration.
        name: What comes before the colon.

    Raises:
        ServerRefusal: The server does not make it, or cannot be reached.
    """
    address = f"{homeserver}/_synapse/admin/v1/register"
    nonce, password = _call(address)["nonce"], secrets.token_urlsafe(32)
    told = "\0".join([nonce, name, password, "notadmin"]).encode()
    body = {
        "nonce": nonce,
        "username": name,
        "password": password,
        "admin": False,
        "mac": hmac.new(secret.encode(), told, hashlib.sha1).hexdigest(),
    }
    made = _call(address, body)
    return Account(user=made["user_id"], token=made["access_token"])


def open_album(homeserver: str, owner: Account) -> AgentAccount:
    """Make an album for an account.

    Raises:
        ServerRefusal: The server does not make it, or cannot be reached.
    """

    def state(kind: str, **content: str) -> dict[str, Any]:
        return {"type": kind, "state_key": "", "content": content}

    body = {
        "preset": "private_chat",
        "visibility": "private",
        "name": f"Album of {owner.user}",
        "initial_state": [
            state("m.room.join_rules", join_rule="knock"),
            state("m.room.history_visibility", history_visibility="shared"),
            state("m.room.guest_access", guest_access="forbidden"),
        ],
        "power_level_content_override": {"invite": 50, "kick": 50, "events_default": 50},
    }
    made = _call(f"{homeserver}/_matrix/client/v3/createRoom", body, owner.token)
    return AgentAccount(user=owner.user, album=made["room_id"], token=owner.token)


def make_directory(
    homeserver: str, secret: str, agents: int, *, prefix: str = "sightfield"
) -> SocialDirectory:
    """Accounts for a pursuer and common agents, named after the prefix, and the agents' albums.

    Raises:
        ServerRefusal: The server does not make them: a name is taken, say.
    """
    pursuer = register_account(homeserver, secret, f"{prefix}-pursuer")
    owners = [register_account(homeserver, secret, f"{prefix}-agent{i}") for i in range(agents)]
    return SocialDirectory(
        homeserver=homeserver,
        pursuer=pursuer,
        agents=tuple(open_album(homeserver, owner) for owner in owners),
    )


def check_accounts(directory: SocialDirectory) -> None:
    """Ask the server whether it is there, and knows everybody whose token is here.

    Raises:
        InvalidInput: It does not answer, or refuses a token, or a token is of another account.
    """
    server = directory.homeserver
    try:
        _call(f"{server}/_matrix/client/versions", patience=10)
    except ServerRefusal as refusal:
        raise InvalidInput(
            f"`homeserver` must be a Matrix server that answers; got {server} ({refusal})"
        ) from None
    for account in (directory.pursuer, *directory.agents):
        if account.token is None:
            continue
        try:
            known = _call(f"{server}/_matrix/client/v3/account/whoami", token=account.token)
        except ServerRefusal as refusal:
            raise InvalidInput(
                f"`accounts` must have a token for {account.user} that the server takes; got one "
                f"that it refuses ({refusal})"
            ) from None
        user = known.get("user_id") if isinstance(known, dict) else None
        require(user == account.user, "accounts", f"have the token of {account.user}", user)


def _call(
    address: str,
    body: dict[str, Any] | None = None,
    token: str | None = None,
    patience: float = 60.0,
) -> Any:
    """Send a GET, or a POST with a body, and return the decoded answer."""
    headers = {"Content-Type": "application/json"}
    if token is not None:
        headers["Authorization"] = f"Bearer {token}"
    data = None if body is None else json.dumps(body).encode()
    try:
        request = urllib.request.Request(address, data, headers)
        with urllib.request.urlopen(request, timeout=patience) as answer:
            return json.load(answer)
    except urllib.error.HTTPError as error:
        said = " ".join(error.read().decode(errors="replace").split())
        raise ServerRefusal(f"{address} says {error.code}: {said[:200]}") from None
    except (urllib.error.URLError, OSError, ValueError, http.client.HTTPException) as error:
        said = " ".join(str(error).split())
        raise ServerRefusal(f"{address} does not answer: {said}") from None

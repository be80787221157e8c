"""Accounts and albums on a homeserver, made once before the first run.

Accounts are registered with the server's shared secret, as Synapse's own command does it; on a
server without one they are made by hand. An album is a private room: anyone may knock, its owner
alone invites, removes and posts, and members read all of it, earlier pictures too.
"""

import hashlib
import hmac
import http.client
import json
import secrets
import urllib.error
import urllib.request
from typing import Any

from ...systems.numerics.errors import InvalidInput, SightfieldError, require
from .accounts import Account, AgentAccount, SocialDirectory


class ServerRefusal(SightfieldError):
    """A homeserver says no for good: trying again would not help."""


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
    """GET, or POST of a body, and the answer."""
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

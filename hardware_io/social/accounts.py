"""Who is who on a homeserver: the accounts of the pursuer and of the common agents.

A file of them is YAML::

    homeserver: https://matrix.example.org
    pursuer: {user: "@pursuer:example.org", token: ...}
    agents:
      - {user: "@agent0:example.org", album: "!room:example.org", token: ...}

An agent's token is needed only where this program posts and answers for it.
"""

import os
import stat
from dataclasses import asdict, dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import yaml

from ...systems.numerics.errors import InvalidInput, require


@dataclass(frozen=True, kw_only=True)
class Account:
    """The pursuer's account.

    Attributes:
        user: Its name, "@name:server".
        token: Its access token.

    Raises:
        InvalidInput: The name is none, or the token is empty.
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
        token: Its access token; None where somebody else runs the agent.

    Raises:
        InvalidInput: The name or the album is none.
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
        InvalidInput: The address is none, or plain http:// to another machine, or two agents share
            an account or an album.
    """

    homeserver: str
    pursuer: Account
    agents: tuple[AgentAccount, ...]

    def __post_init__(self):
        address = self.homeserver.startswith(("http://", "https://"))
        require(address, "homeserver", "begin with http:// or https://", self.homeserver)
        # Tokens and pictures would go over the network for all to read.
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
    try:
        content: Any = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
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
    mode = stat.S_IMODE(Path(path).stat().st_mode)
    wish = f"be readable by you alone, as it holds tokens: chmod 600 {path}"
    require(not mode & 0o077, "accounts", wish, f"mode {mode:o}")
    return found


def save_directory(directory: SocialDirectory, path: str | Path) -> None:
    """Write a directory as YAML, readable by its owner alone: it holds tokens."""
    content = asdict(directory) | {"agents": [asdict(agent) for agent in directory.agents]}
    new = Path(path).with_name(Path(path).name + ".new")
    with open(os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
        yaml.safe_dump(content, file, sort_keys=False)
    new.replace(path)


def _is_here(address: str) -> bool:
    """Whether an address is of this machine, whatever a name server says."""
    try:
        host = urlsplit(address).hostname or ""
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _require_user(user: str) -> None:
    whole = user.startswith("@") and ":" in user
    require(whole, "user", "be a full name, @name:server", user)

"""The pursuer's interface to a social network: requests, answers, and the pictures of friends.

Agents are integers from 0. No call waits for a server: it is carried out when possible, and its
outcome appears in later `responses`. `scan` reads the newest pictures of every friend, each only
once; Algorithm 3 would read the same picture again and again while nothing newer is posted.

Source: Zhang 2014, 2.3.2 and Algorithm 3; the interface is ours.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from ...errors import SightfieldError


class NotFriends(SightfieldError):
    """Pictures were asked for of an agent that is not a friend."""


class Answer(Enum):
    """What an agent does with a request, or with a friendship. Silence is no answer."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    UNFRIENDED = "unfriended"


@dataclass(frozen=True, kw_only=True)
class Response:
    """Something an agent did.

    Attributes:
        agent: Who.
        answer: What.
    """

    agent: int
    answer: Answer


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture in an agent's album.

    Attributes:
        id: Its name, unlike that of any other picture of the network.
        agent: Who posted it.
        time: When it was taken [s].
        data: The encoded file. PNG or JPEG is expected, but people post anything.
    """

    id: str
    agent: int
    time: float
    data: bytes


class SocialNetwork(Protocol):
    """One pursuer's account and the albums of the common agents."""

    def agents(self) -> tuple[int, ...]:
        """All agents that have an account, rising."""
        ...

    def begin(self) -> None:
        """Start a run. In memory everything is forgotten; a server keeps what it knows."""
        ...

    def advance(self, iteration: int) -> None:
        """Let agents answer; called in each iteration between sending requests and `responses`."""
        ...

    def request(self, agent: int) -> None:
        """Ask an agent for its friendship. Asking twice is asking once."""
        ...

    def withdraw(self, agent: int) -> None:
        """Take a request back; if it was accepted meanwhile, end the friendship."""
        ...

    def responses(self) -> list[Response]:
        """What agents did since the last call, in order."""
        ...

    def friends(self) -> frozenset[int]:
        """Agents whose album the pursuer may read now."""
        ...

    def post(self, agent: int, picture: Picture) -> None:
        """Put a picture into its agent's album, behind the earlier ones."""
        ...

    def latest(self, agent: int, count: int) -> list[Picture]:
        """A friend's most recent pictures, newest first, at most `count`.

        Raises:
            NotFriends: The agent is not a friend.
        """
        ...


@dataclass(frozen=True)
class Scan:
    """One look at the friends' albums.

    Attributes:
        pictures: Those not looked at before; by friend, then the oldest first.
        seen: Ids of each friend's newest pictures at its last look, for the next scan.
    """

    pictures: tuple[Picture, ...]
    seen: Mapping[int, frozenset[str]]


def scan(
    network: SocialNetwork, friends: Collection[int], count: int, last: Scan | None = None
) -> Scan:
    """Look at the most recent pictures of every friend.

    Albums only grow at their end, so a picture that has left an album's newest ones never returns
    to them: it is enough to remember the newest ones of the last look.

    Args:
        network: The network.
        friends: Agents whose albums are to be read; one that is no longer a friend is skipped.
        count: N_img, pictures of each friend.
        last: The previous scan; by default none.
    """
    seen = dict(last.seen) if last is not None else {}
    found: list[Picture] = []
    for friend in sorted(friends):
        try:
            newest = network.latest(friend, count)
        except NotFriends:
            continue
        known = seen.get(friend, frozenset())
        found += [picture for picture in reversed(newest) if picture.id not in known]
        seen[friend] = frozenset(picture.id for picture in newest)
    return Scan(tuple(found), seen)

"""Image scanning: the newest pictures of every friend, none of them twice.

Source: Zhang 2014, Algorithm 3, which would look at the same picture again and again while nothing
newer is posted.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from .interface import NotFriends, Picture, SocialNetwork


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

    Albums only grow at their end, so a picture that is no longer among an album's newest never
    comes back to them: it is enough to remember what was among them at the last look.

    Args:
        network: Whose albums.
        friends: Whose albums are to be read; one that is no friend any more is passed over.
        count: N_img, pictures of each friend.
        last: The scan before; by default none.
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

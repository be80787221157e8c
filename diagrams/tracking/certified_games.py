"""Games of certified pursuers against every evader there is, each held against its promises."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...systems.numerics.errors import InvalidInput, require, require_one_of
from ...systems.numerics.geometry.world import World
from ...systems.numerics.run_seeds import run_seed
from .game import set_up_game, with_random_starts
from .promises import Promises, audit_promises
from .run import run_tracking
from .scenario import CERTIFIED, GUARANTEE, POLICIES, TrackingScenario

# Policies that play by themselves, anywhere.
OPPONENTS = tuple(policy for policy in POLICIES if policy not in ("waypoints", "you"))


@dataclass(frozen=True, kw_only=True)
class CertifiedGame:
    """A game of certified pursuers.

    Attributes:
        policy: The evaders'.
        number: Of its starts, from 0.
        seed: From which the starts are drawn.
        tracking_time: Until some evader is seen by nobody; the end of the game if never [s].
        lost_evader: Its number, or None.
        reassignments: How often a pursuer got another evader.
        promises: What was promised, and what came of it.
    """

    policy: str
    number: int
    seed: int
    tracking_time: float
    lost_evader: int | None
    reassignments: int
    promises: Promises


class PolicyTally(NamedTuple):
    """What certified pursuers made of one policy.

    Attributes:
        games: How many were played.
        kept: Of these, how many kept every promise.
        promised: Of these, how many promised something at some moment that stood to the end.
        lost: Of these, how many ended with a loss of sight.
        margin: Least of what sight lasted beyond the certificate, None where no certificate stood
            when sight was lost [s].
        withdrawn: Promises withdrawn because a pursuer was deflected, in all games.
    """

    games: int
    kept: int
    promised: int
    lost: int
    margin: float | None
    withdrawn: int


def certified(scenario: TrackingScenario, policy: str, seed: int) -> TrackingScenario:
    """The scenario with certified pursuers, matched by the certificate, from drawn starts.

    Args:
        scenario: Whose world, robots and sizes of teams.
        policy: Of the evaders.
        seed: Of the starts.

    Raises:
        InvalidInput: The policy is unknown, or these robots cannot be certified.
    """
    require_one_of("policies", policy, OPPONENTS)
    pursuers, evaders = scenario.pursuers, scenario.evaders
    return with_random_starts(
        replace(
            scenario,
            seed=seed,
            pursuers=replace(pursuers, field=CERTIFIED, assignment=GUARANTEE, hold=""),
            evaders=replace(evaders, policies=[policy], waypoints=[]),
        )
    )


def play_certified_games(
    scenario: TrackingScenario,
    *,
    games: int,
    seed: int = 0,
    policies: Sequence[str] = OPPONENTS,
    world: World | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[CertifiedGame]:
    """Play the same starts against each policy.

    Args:
        scenario: Whose world, robots, sizes of teams and horizon.
        games: Starts, at least 1.
        seed: From which the seeds of the starts are drawn.
        policies: Of the evaders, each in games of its own.
        world: The scenario's, where it is loaded already.
        progress: Told how many games are done, of how many.

    Returns:
        By starts, then by policies.

    Raises:
        InvalidInput: A number is out of its range, or these robots cannot be certified.
    """
    require(games > 0, "games", "be positive", games)
    found: list[CertifiedGame] = []
    world = world or scenario.world.load()
    total = games * len(policies)
    for number in range(games):
        start = run_seed(seed, number)
        for policy in policies:
            try:
                game = set_up_game(certified(scenario, policy, start), world)
            except InvalidInput as error:
                raise InvalidInput(f"{error} (in game {number})") from None
            run = run_tracking(game)
            changes = np.diff(run.log["assignment"], axis=0) != 0
            found.append(
                CertifiedGame(
                    policy=policy,
                    number=number,
                    seed=start,
                    tracking_time=run.tracking_time,
                    lost_evader=run.lost_evader,
                    reassignments=int(changes.sum()),
                    promises=audit_promises(run),
                )
            )
            progress(len(found), total)
    return found


def tally(games: Sequence[CertifiedGame]) -> dict[str, PolicyTally]:
    """What certified pursuers made of each policy, in the order in which they come.

    Args:
        games: Of any number of policies.
    """
    found = {}
    for policy in dict.fromkeys(game.policy for game in games):
        promises = [game.promises for game in games if game.policy == policy]
        margins = [each.margin for each in promises if not np.isnan(each.margin)]
        found[policy] = PolicyTally(
            games=len(promises),
            kept=sum(not each.breach for each in promises),
            promised=sum(each.claimed > 0.0 for each in promises),
            lost=sum(game.lost_evader is not None for game in games if game.policy == policy),
            margin=min(margins) if margins else None,
            withdrawn=sum(each.withdrawn for each in promises),
        )
    return found

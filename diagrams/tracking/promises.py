"""Whether certified pursuers kept their word in a game, from its log alone.

A certificate C of a sample at t says that all evaders are in sight until t + C, and a pursuer's own
guaranteed time the same of its own evader. Both stand until a pursuer is deflected or gets another
evader, and no longer; nothing else may take a promise back.
"""

import math
from typing import NamedTuple

import numpy as np

from .run import CERTIFICATE, GUARANTEED_TIME, WITHDRAWN, TrackingRun

# Times that differ by less are the same [s].
ROUNDING = 1e-6


class Promises(NamedTuple):
    """What was promised in a game, and what came of it.

    Attributes:
        breach: The first promise that was not kept, in words; empty where all were.
        claimed: The certificate that stood and was tried hardest: of those that stood when sight
            was lost the one that reached farthest, of those of a game without a loss the longest;
            infinite if for ever, 0 where none stood [s].
        lasted: For how long sight lasted from then on, to the loss or the end of the game [s].
        margin: `lasted` less `claimed` where sight was lost; NaN where it was not, and where no
            certificate stood [s].
        withdrawn: How often a pursuer's promise was withdrawn because it was deflected.
    """

    breach: str
    claimed: float
    lasted: float
    margin: float
    withdrawn: int


def audit_promises(run: TrackingRun) -> Promises:
    """Hold a game's log against what its certified pursuers promised.

    Args:
        run: Of certified pursuers.
    """
    end, lost = run.tracking_time, run.lost_evader is not None
    known = run.times <= end
    times = run.times[known]
    log = {name: samples[known] for name, samples in run.log.items()}
    withdrawn, assignment = log[WITHDRAWN], log["assignment"]
    changed = np.zeros_like(withdrawn)
    changed[1:] = assignment[1:] != assignment[:-1]
    void = withdrawn | changed
    breach = _own_breach(times, log, void)
    certificate = log[CERTIFICATE][:, 0]
    last = int(np.flatnonzero(np.append(True, void.any(axis=1)))[-1]) - 1
    # What stood until the next void moment, or the end.
    if not breach and lost:
        standing = np.arange(len(times)) >= max(last, 0)
        short = standing & (certificate > 0.0) & (times + certificate > end + ROUNDING)
        if short.any():
            k = int(np.flatnonzero(short)[0])
            breach = (
                f"at {times[k]:.2f} s all were to be in sight for {_seconds(certificate[k])}, "
                f"and sight was lost after {end - times[k]:.2f} s"
            )
    claims = np.flatnonzero((np.arange(len(times)) >= max(last, 0)) & (certificate > 0.0))
    claimed, lasted, margin = 0.0, 0.0, math.nan
    if len(claims):
        reach = times[claims] + certificate[claims] if lost else certificate[claims]
        # Of equal ones the earliest.
        k = claims[int(np.argmax(reach >= reach.max() - ROUNDING))]
        claimed, lasted = float(certificate[k]), float(end - times[k])
        margin = lasted - claimed if lost else math.nan
    episodes = withdrawn & ~np.vstack([np.zeros_like(withdrawn[:1]), withdrawn[:-1]])
    return Promises(breach, claimed, lasted, margin, int(episodes.sum()))


def _own_breach(times: np.ndarray, log: dict[str, np.ndarray], void: np.ndarray) -> str:
    """The first moment at which a pursuer does not see its own evader as promised, or takes a
    promise back; empty where there is none."""
    promised = np.where(log[WITHDRAWN], 0.0, log[GUARANTEED_TIME])
    until = np.full(promised.shape[1], -math.inf)
    for k, now in enumerate(times):
        until = np.where(void[k], -math.inf, until)
        for i, evader in enumerate(log["assignment"][k]):
            if evader < 0:
                continue
            if now + promised[k, i] < until[i] - ROUNDING and now < until[i] - ROUNDING:
                return (
                    f"at {now:.2f} s pursuer {i} promises {_seconds(promised[k, i])} of evader "
                    f"{evader}, {_seconds(until[i] - now)} before"
                )
            until[i] = max(until[i], now + promised[k, i] if promised[k, i] > 0 else -math.inf)
            if now < until[i] - ROUNDING and not log["visibility"][k, i, evader]:
                return (
                    f"at {now:.2f} s pursuer {i} does not see evader {evader}, promised for "
                    f"another {_seconds(until[i] - now)}"
                )
    return ""


def _seconds(time: float) -> str:
    return "ever" if math.isinf(time) else f"{time:.2f} s"

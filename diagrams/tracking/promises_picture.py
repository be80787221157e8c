"""How long sight lasted in games of certified pursuers, against what they had promised."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .certified_games import CertifiedGame

# A colour and a mark for each policy, in order.
STYLES = (
    ("#215fcc", "o"),
    ("#d92e33", "s"),
    ("#2e8b57", "^"),
    ("#8b3fb0", "D"),
    ("#e08a00", "v"),
    ("#555555", "P"),
)


def draw_promises(games: Sequence[CertifiedGame], seconds: float) -> Figure:
    """Draw for each game how long sight lasted from a moment on, against the certificate then.

    Of each game that certificate is drawn that stood and was tried hardest, see `Promises`.

    Args:
        games: Of any number of policies.
        seconds: Horizon of the games [s].
    """
    figure = Figure(figsize=(7.6, 6.4), layout="constrained")
    axes = figure.subplots()
    finite = [g.promises.claimed for g in games if 0.0 < g.promises.claimed < math.inf]
    longest = max([*finite, 0.25 * seconds])
    ever = 1.12 * longest
    axes.axvline(ever, color="#cccccc", linewidth=40, zorder=0)
    axes.plot([0.0, longest], [0.0, longest], color="black", linewidth=1.2, label="T = C")
    axes.fill_between([0.0, longest], [0.0, longest], color="#d92e33", alpha=0.10, linewidth=0)
    # So that games for ever do not hide each other.
    spread = np.random.default_rng(0)
    for k, policy in enumerate(dict.fromkeys(game.policy for game in games)):
        colour, mark = STYLES[k % len(STYLES)]
        axes.plot([], [], mark, color=colour, label=policy)
        for game in games:
            claimed, promises = game.promises.claimed, game.promises
            if game.policy != policy or claimed == 0.0:
                continue
            x = ever + spread.uniform(-0.05, 0.05) * longest if math.isinf(claimed) else claimed
            lost = game.lost_evader is not None
            axes.plot(
                x,
                promises.lasted,
                mark,
                color=colour,
                markerfacecolor=colour if lost else "none",
                markersize=11 if promises.breach else 6,
                markeredgewidth=1.2,
            )
    axes.set_xlim(0.0, 1.2 * longest)
    axes.set_ylim(0.0, None)
    ticks = [tick for tick in axes.get_xticks() if tick <= longest]
    axes.set_xticks([*ticks, ever], [*(f"{tick:g}" for tick in ticks), "for ever"])
    axes.set_xlabel("certificate C while it stood [s]")
    axes.set_ylabel("sight lasted T from then on [s]")
    axes.set_title("T against C; hollow: to the end of the game")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=4)
    axes.grid(alpha=0.3)
    return figure


def save_promises_picture(path: Path, games: Sequence[CertifiedGame], seconds: float) -> None:
    """Write `draw_promises` to a PNG.

    Args:
        path: Of the file.
        games, seconds: See `draw_promises`.
    """
    draw_promises(games, seconds).savefig(path, dpi=110)

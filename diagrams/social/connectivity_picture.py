"""Who was the pursuer's friend when: Figure 2.34, drawn from a run."""

import numpy as np
from matplotlib.axes import Axes

from .scene.palette import agent_rgb

_WAITING = "#b9bdc2"


def draw_connectivity(
    axes: Axes, times: np.ndarray, connected: np.ndarray, waiting: np.ndarray | None = None
) -> None:
    """Draw one band for each agent, filled while it is a friend, gray while it is asked.

    Args:
        axes: Where to; limits and labels are set.
        times: Samples, shape (T,) [s].
        connected: Shape (T, agents), bool.
        waiting: Same shape, bool; None draws friendships only.

    Source: Zhang 2014, Figure 2.34.
    """
    agents = connected.shape[1]
    for k in range(agents):
        bottom = agents - 1 - k
        for state, colour, height in (
            (None if waiting is None else waiting[:, k] & ~connected[:, k], _WAITING, 0.22),
            (connected[:, k], agent_rgb(k), 0.7),
        ):
            if state is None:
                continue
            spans = runs(times, state)
            axes.broken_barh(spans, (bottom + 0.5 - 0.5 * height, height), facecolors=colour)
        share = float(connected[:, k].mean())
        axes.text(1.01, bottom + 0.5, f"{100 * share:.0f} %", va="center",
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_yticks(np.arange(agents) + 0.5, [f"agent {agents - k}" for k in range(agents)])
    axes.set_ylim(0, agents)
    axes.set_xlim(float(times[0]), float(times[-1]) if times[-1] > times[0] else times[0] + 1.0)
    axes.set_xlabel("time [s]")
    everyone = float(connected.all(axis=1).mean())
    axes.set_title(f"connectivity (Figure 2.34); all at once {100 * everyone:.0f} % of the time")
    axes.grid(axis="x", alpha=0.3)


def runs(times: np.ndarray, state: np.ndarray) -> list[tuple[float, float]]:
    """Start and duration of every stretch in which a state holds, sample by sample [s].

    Args:
        times: Of the samples, shape (n,) [s].
        state: Whether it holds, shape (n,).
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], state.astype(int), [0]])))
    ends = np.append(times, times[-1])
    return [(float(times[a]), float(ends[b] - times[a])) for a, b in edges.reshape(-1, 2).tolist()]

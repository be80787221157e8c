"""What a supervisor's decisions say in words, when they change."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .reasons import WORDS, Reason, Standing


class Transition(NamedTuple):
    """A robot, or all of them, came to stand otherwise.

    Attributes:
        robot: Its name, "" for all.
        text: What it is now, and why.
        fault: Whether something is wrong.
    """

    robot: str
    text: str
    fault: bool


def standing_name(standing: float) -> str:
    """armed, running, held or lost; unknown for a number that is none of theirs, as a log may hold.

    Args:
        standing: Number of Standing [-].
    """
    known = standing in tuple(Standing)
    return Standing(int(standing)).name.lower() if known else "unknown"


def reason_words(reason: float) -> str:
    """A reason in words, "" for none or a number that is none of theirs.

    Args:
        reason: Number of Reason [-].
    """
    return WORDS[Reason(int(reason))] if reason in tuple(Reason) else ""


def transitions(
    names: Sequence[str],
    before: tuple[np.ndarray, np.ndarray] | None,
    now: tuple[np.ndarray, np.ndarray],
) -> list[Transition]:
    """What has changed from one tick to the next; what is the same of all robots is told once.

    Args:
        names: Of the robots.
        before: Numbers of Standing and Reason a tick ago, shape (N,) each; None at the first tick.
        now: The same now, shape (N,) each.
    """
    numbers = np.stack(now, axis=1)
    changed = np.ones(len(names), bool)
    if before is not None:
        changed = (numbers != np.stack(before, axis=1)).any(axis=1)
    if changed.all() and (numbers == numbers[0]).all():
        return [_transition("", *numbers[0])]
    told = zip(names, numbers, changed, strict=True)
    return [_transition(name, *each) for name, each, new in told if new]


def _transition(robot: str, standing: float, reason: float) -> Transition:
    why = reason_words(reason)
    name = standing_name(standing)
    fault = name in ("held", "lost") and int(reason) != Reason.OPERATOR_STOP
    return Transition(robot, f"{name}: {why}" if why else name, fault)

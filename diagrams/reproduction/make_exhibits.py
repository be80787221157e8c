"""Makes exhibits one by one; what goes wrong with one is told, and the others are still made."""

import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..outputs import lacks_room
from .evidence import Evidence, Exhibit, Workshop

FAILED = "failed"


@dataclass(frozen=True)
class Made:
    """An exhibit, and what came of making it.

    Attributes:
        exhibit: Which.
        evidence: What came out; None if it could not be made.
        error: Why not, with where it happened; else empty.
        seconds: How long it took [s].
    """

    exhibit: Exhibit
    evidence: Evidence | None
    error: str
    seconds: float

    @property
    def verdict(self) -> str:
        """Of the evidence, or FAILED."""
        return FAILED if self.evidence is None else self.evidence.verdict


def make_exhibits(
    exhibits: Sequence[Exhibit],
    workshop: Workshop,
    begin: Callable[[Exhibit], None] = lambda exhibit: None,
) -> tuple[Made, ...]:
    """Make exhibits.

    Args:
        exhibits: In this order.
        workshop: How, and where.
        begin: Told which one is next.

    Raises:
        NoRoom: The disk is full; no other exhibit could be kept either.
    """
    return tuple(_make(exhibit, workshop, begin) for exhibit in exhibits)


def _make(exhibit: Exhibit, workshop: Workshop, begin: Callable[[Exhibit], None]) -> Made:
    begin(exhibit)
    began = time.perf_counter()
    evidence, error = None, ""
    try:
        evidence = exhibit.make(workshop)
    except Exception as fault:  # whatever it was, it belongs on the page beside what went well
        # But for a page there has to be room.
        if lacks_room(fault):
            raise
        error = traceback.format_exc()
    return Made(exhibit, evidence, error, time.perf_counter() - began)

"""All exhibits in the order of the page, made one by one; to add one, add a line here.

What goes wrong with one is told, and the others are still made.
"""

import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from ...systems.numerics.errors import require
from ..outputs import lacks_room
from .exhibits.beyond_teams import RADIO, RANK_AGGREGATIONS, RISK_VECTOR_GAPS
from .exhibits.evidence import Evidence, Exhibit, Workshop
from .exhibits.harvest import FIELD_PATHS, UNLOADING
from .exhibits.planning import CART_PATHS, CART_SWEEP
from .exhibits.social import LANDMARK_LOCATION, SOCIAL_CONNECTIVITY
from .exhibits.solved_game import SOLVED_GAME
from .exhibits.tracking import (
    ALLOCATIONS,
    CORNER_FIELDS,
    CORNER_POLICIES,
    RISK_TRACKS,
    TEAM_TIMES,
    VECTOR_FIELDS,
)
from .exhibits.vision import CAMERA_ERRORS, STANDOFF_RESPONSES

EXHIBITS = (
    CORNER_POLICIES,
    CORNER_FIELDS,
    VECTOR_FIELDS,
    RISK_TRACKS,
    CAMERA_ERRORS,
    TEAM_TIMES,
    ALLOCATIONS,
    STANDOFF_RESPONSES,
    SOCIAL_CONNECTIVITY,
    *UNLOADING,
    FIELD_PATHS,
    CART_PATHS,
    CART_SWEEP,
    RISK_VECTOR_GAPS,
    RANK_AGGREGATIONS,
    RADIO,
    LANDMARK_LOCATION,
    SOLVED_GAME,
)

# Asks for all that the thesis has not.
BEYOND = "beyond"


def slug(label: str) -> str:
    """The id of a figure or table: that of the label "Figure 2.17" is "figure-2.17".

    Args:
        label: Of the figure or table.
    """
    return label.lower().replace(" ", "-")


def chosen_exhibits(wanted: Sequence[str]) -> tuple[Exhibit, ...]:
    """The exhibits that are asked for, in the order of the page; none asked for: all.

    Args:
        wanted: Ids of exhibits, or of figures and tables that they cover, or BEYOND.

    Raises:
        InvalidInput: There is no such exhibit.
    """
    known: dict[str, tuple[str, ...]] = {each.id: (each.id,) for each in EXHIBITS}
    known |= {slug(label): (each.id,) for each in EXHIBITS for label in each.covers}
    known[BEYOND] = tuple(each.id for each in EXHIBITS if not each.covers)
    for name in wanted:
        require(name in known, "only", f"be one of {', '.join(known)}", name)
    chosen = {found for name in wanted or known for found in known[name]}
    return tuple(each for each in EXHIBITS if each.id in chosen)


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


def summarise(made: Sequence[Made], *, quick: bool) -> dict[str, object]:
    """The report, ready for JSON.

    Returns:
        quick, seconds (all in all) [s], and exhibits: id, covers, title, command, verdict, seconds,
        error (None if there was none), findings (subject, thesis, ours, verdict each).
    """
    return {
        "quick": quick,
        "seconds": sum(each.seconds for each in made),
        "exhibits": [
            {
                "id": each.exhibit.id,
                "covers": list(each.exhibit.covers),
                "title": each.exhibit.title,
                "command": each.exhibit.command,
                "verdict": each.verdict,
                "seconds": each.seconds,
                "error": each.error.strip().splitlines()[-1] if each.error else None,
                "findings": [asdict(finding) for finding in each.evidence.findings]
                if each.evidence
                else [],
            }
            for each in made
        ],
    }

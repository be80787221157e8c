"""All exhibits in the order of the page: to add one, write a file and add a line here."""

from collections.abc import Sequence

from ...systems.numerics.errors import require
from .beyond.aggregations import RANK_AGGREGATIONS
from .beyond.radio import RADIO
from .beyond.risk_vectors import RISK_VECTOR_GAPS
from .beyond.solved_game import SOLVED_GAME
from .evidence import Exhibit
from .exhibits.allocations import ALLOCATIONS
from .exhibits.camera_errors import CAMERA_ERRORS
from .exhibits.cart_paths import CART_PATHS
from .exhibits.cart_sweep import CART_SWEEP
from .exhibits.corner_tables import FIELDS, POLICIES
from .exhibits.field_paths import FIELD_PATHS
from .exhibits.risk_tracks import RISK_TRACKS
from .exhibits.social_connectivity import SOCIAL_CONNECTIVITY
from .exhibits.standoff_responses import STANDOFF_RESPONSES
from .exhibits.team_times import TEAM_TIMES
from .exhibits.unloading import UNLOADING
from .exhibits.vector_fields import VECTOR_FIELDS

EXHIBITS = (
    POLICIES,
    FIELDS,
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

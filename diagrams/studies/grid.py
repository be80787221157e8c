"""How the cells of a study belong together: what is drawn with what, what is compared."""

from dataclasses import dataclass, field

from .opponents import match_of
from .study import Study


@dataclass(frozen=True, kw_only=True)
class StudyPanel:
    """One pair of axes.

    Attributes:
        title: What it shows.
        series: By label, names of cells over the number of evaders.
    """

    title: str
    series: dict[str, dict[int, str]]


@dataclass(frozen=True, kw_only=True)
class StudyGrid:
    """The panels of a study, and its comparisons.

    Attributes:
        means: Panels of restricted means over the number of evaders.
        curves: Panels of survival curves; a cell's number of evaders is not drawn there.
        pairs: Names of cells to compare run by run.
        matrix: Pursuers against evaders: by sizes of the teams ("3v4"), by what the pursuers do,
            by what the evaders do, the name of the cell.
        columns: Panels of means side by side; 0: all.
    """

    means: tuple[StudyPanel, ...] = ()
    curves: tuple[StudyPanel, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()
    matrix: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)
    columns: int = 0


def matrix_of(study: Study) -> dict[str, dict[str, dict[str, str]]]:
    """The matrix of a study whose cells are named by `cell_name`, in the order of its cells.

    Args:
        study: Any such.
    """
    found: dict[str, dict[str, dict[str, str]]] = {}
    for cell in study.cells:
        match = match_of(cell.name)
        rows = found.setdefault(f"{match.pursuers}v{match.evaders}", {})
        rows.setdefault(match.variant, {})[match.opponent] = cell.name
    return found

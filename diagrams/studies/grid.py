"""How the cells of a study belong together: what is drawn with what, what is compared."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One pair of axes.

    Attributes:
        title: What it shows.
        series: By label, names of cells over the number of evaders.
    """

    title: str
    series: dict[str, dict[int, str]]


@dataclass(frozen=True, kw_only=True)
class Grid:
    """The panels of a study, and its comparisons.

    Attributes:
        means: Panels of restricted means over the number of evaders.
        curves: Panels of survival curves; a cell's number of evaders is not drawn there.
        pairs: Names of cells to compare run by run.
    """

    means: tuple[Panel, ...]
    curves: tuple[Panel, ...]
    pairs: tuple[tuple[str, str], ...]

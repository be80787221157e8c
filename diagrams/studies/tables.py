"""A study's restricted means as tables, for the terminal and, in Markdown, for a page."""

from dataclasses import dataclass
from typing import Any

from .grid import StudyGrid


@dataclass(frozen=True)
class MeanTable:
    """Restricted means with their intervals.

    Attributes:
        title: What they are [s].
        head: Of the columns.
        rows: As many entries each, the first being the row's label.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def mean_tables(summary: dict[str, Any], grid: StudyGrid) -> tuple[MeanTable, ...]:
    """The panels of a study over the number of evaders or, where it has none, its matrices.

    Args:
        summary: From `summarise_study`.
        grid: Of the same study.
    """
    level = f"{summary['confidence']:.0%}"
    if not grid.means:
        return tuple(
            _matrix_table(f"{size}: mean [s], {level} interval, * the worst", rows, worst)
            for (size, rows), worst in zip(
                summary["matrix"].items(), summary["worst"].values(), strict=True
            )
        )
    found = []
    for panel in grid.means:
        evaders = sorted({m for series in panel.series.values() for m in series})
        rows = tuple(
            (label, *(_interval(**_means(summary, series[m])) for m in evaders))
            for label, series in panel.series.items()
        )
        title = f"{panel.title}: mean up to the horizon [s], {level} interval"
        found.append(MeanTable(title, ("evaders", *map(str, evaders)), rows))
    return tuple(found)


def to_markdown(tables: tuple[MeanTable, ...]) -> str:
    """Tables as a page has them, each below its title.

    Args:
        tables: In this order.
    """
    parts = []
    for table in tables:
        lines = [table.head, ("---",) * len(table.head), *table.rows]
        body = "\n".join(f"| {' | '.join(entry.strip() for entry in line)} |" for line in lines)
        parts.append(f"{table.title}\n\n{body}\n")
    return "\n".join(parts)


def _matrix_table(
    title: str, rows: dict[str, dict[str, dict[str, float]]], worst: dict[str, str]
) -> MeanTable:
    opponents = tuple(next(iter(rows.values())))
    entries = tuple(
        (
            name,
            *(
                _interval(**row[opponent]) + (" *" if opponent == worst[name] else "  ")
                for opponent in opponents
            ),
        )
        for name, row in rows.items()
    )
    return MeanTable(title, ("pursuers", *opponents), entries)


def _means(summary: dict[str, Any], cell: str) -> dict[str, float]:
    mean = summary["cells"][cell]["mean"]
    return {"mean": mean["value"], "low": mean["low"], "high": mean["high"]}


def _interval(mean: float, low: float, high: float) -> str:
    return f"{mean:.1f} ({low:.1f}-{high:.1f})"

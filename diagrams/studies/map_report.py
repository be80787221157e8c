"""What a study of maps leaves: its table, its numbers, and a picture of both."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .map_study import FACTORS, MapResult, mean_share
from .tables import MeanTable, to_markdown

CONFIDENCE = 0.95


def summarise_maps(result: MapResult) -> dict[str, Any]:
    """The study in numbers, ready for JSON.

    Args:
        result: A finished study.

    Returns:
        grid [m], bound, speed_ratio and arenas (of each value; 1 in a world of one's own) of the
        study, confidence, and factors: by name for each value the mean over the arenas of kept,
        the part of the pairs in sight that are kept so for ever, with low and high, and of
        sighted, the part of all pairs that are in sight.
    """
    study = result.study
    factors: dict[str, list[dict[str, float]]] = {}
    for factor, values in result.found.items():
        factors[factor] = []
        for value in values:
            kept = mean_share(result.kept(factor, value), CONFIDENCE)
            sighted = float(result.sighted(factor, value).mean())
            entry = {"value": value, "kept": kept.value, "low": kept.low, "high": kept.high}
            factors[factor].append({**entry, "sighted": sighted})
    return {
        "study": "map",
        "seed": study.seed,
        "arenas": study.arenas if study.world is None else 1,
        "grid": study.grid,
        "bound": study.bound,
        "speed_ratio": study.speed_ratio,
        "confidence": CONFIDENCE,
        "factors": factors,
    }


def map_tables(summary: dict[str, Any]) -> tuple[MeanTable, ...]:
    """A table for each factor.

    Args:
        summary: From `summarise_maps`.
    """
    several = summary["arenas"] > 1
    interval = f", {summary['confidence']:.0%} interval" if several else ""
    head = f"of the pairs in sight, kept for ever{interval}"
    return tuple(
        MeanTable(
            f"{FACTORS[factor]}",
            (FACTORS[factor].partition(" [")[0], head, "of all pairs, in sight"),
            tuple(
                (
                    f"{each['value']:g}",
                    f"{each['kept']:.3f}"
                    + (f" ({each['low']:.3f}-{each['high']:.3f})" if several else ""),
                    f"{each['sighted']:.3f}",
                )
                for each in entries
            ),
        )
        for factor, entries in summary["factors"].items()
    )


def draw_maps(result: MapResult) -> Figure:
    """Shares kept over each factor: a dot for each arena, the means with their intervals.

    Args:
        result: A finished study.
    """
    factors = list(result.found)
    columns = min(3, len(factors))
    rows = -(-len(factors) // columns)
    figure = Figure(figsize=(0.8 + 3.6 * columns, 0.8 + 3.2 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axis in axes.ravel()[len(factors) :]:
        axis.set_axis_off()
    for axis, factor in zip(axes.ravel(), factors, strict=False):
        _draw_factor(axis, result, factor)
    axes[0, 0].set_ylim(0.0, 1.02)
    figure.supylabel("share of the pairs in sight", fontsize=10)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _draw_factor(axis: Axes, result: MapResult, factor: str) -> None:
    values = np.array(list(result.found[factor]))
    spread = 0.012 * (values.max() - values.min())
    for k, value in enumerate(values):
        shares = result.kept(factor, float(value))
        # Side by side, so that no dot hides another.
        aside = spread * np.linspace(-1.0, 1.0, len(shares)) if len(shares) > 1 else np.zeros(1)
        axis.plot(
            value + aside,
            shares,
            "o",
            color="tab:gray",
            alpha=0.4,
            markersize=3,
            label="one arena" if k == 0 and len(shares) > 1 else None,
        )
    means = [mean_share(result.kept(factor, float(value)), CONFIDENCE) for value in values]
    mean = np.array([each.value for each in means])
    reach = np.array([mean - [e.low for e in means], [e.high for e in means] - mean])
    axis.errorbar(
        values,
        mean,
        yerr=reach,
        color="tab:blue",
        marker="o",
        markersize=5,
        linewidth=1.2,
        capsize=3,
        label="kept for ever"
        if len(result.kept(factor, float(values[0]))) == 1
        else f"kept for ever, mean, {CONFIDENCE:.0%} interval",
    )
    axis.set_xlabel(FACTORS[factor])
    axis.grid(alpha=0.3)


def write_map_report(result: MapResult, summary: dict[str, Any], folder: Path) -> list[str]:
    """Write the table, numbers and picture of a finished study; return the names of the files.

    Args:
        result: A finished study.
        summary: From `summarise_maps`.
        folder: Exists.
    """
    rows = [
        {"factor": factor, "value": value, "arena": k, **each._asdict()}
        for factor, values in result.found.items()
        for value, some in values.items()
        for k, each in enumerate(some)
    ]
    pq.write_table(pa.Table.from_pylist(rows), folder / "table.parquet")
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    tables = to_markdown(map_tables(summary))
    (folder / "tables.md").write_text(tables, encoding="utf-8")
    draw_maps(result).savefig(folder / "map.png", dpi=120)
    return ["table.parquet", "summary.json", "tables.md", "map.png"]

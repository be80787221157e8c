"""What a verdict leaves: a table to read, numbers to parse, a folder of pictures and a replay."""

import math
from pathlib import Path

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from ..outputs import write_json
from .pictures import save_paths_picture, save_states_picture, save_value_picture
from .replay import write_planning_replay
from .verdict import PlanningVerdict, Row, contradictions, reasons, status_of

# Overlaps from here on are told [m], and angles beyond half a turn by more than this [rad].
_SHOWN_OVERLAP, _ROUNDING = 1e-4, 1e-6
# What the half-widths of a goal are along: its box turns with it.
_ALONG = ("goal's heading", "across it", "theta", "beta")


def as_object(verdict: PlanningVerdict) -> dict[str, object]:
    """A verdict as JSON takes it; numbers that are not there, or infinite, are null."""
    return {
        "start": list(verdict.question.start),
        "goal": list(verdict.question.goal.state),
        "goal_tolerance": [_finite(width) for width in verdict.question.goal.tolerance],
        "goal_tolerance_along": list(_ALONG),
        "lower_bound": verdict.lower_bound,
        "best_time": _finite(verdict.best_time),
        "methods": {row.method: _row_object(verdict, row) for row in verdict.rows},
        "remarks": [f"{row.method}: {remark}" for row in verdict.rows for remark in _remarks(row)],
        "contradictions": contradictions(verdict),
    }


def as_table(verdict: PlanningVerdict) -> Table:
    """A verdict as a table for the terminal."""
    table = Table(
        title=f"{_goal_words(verdict)}; no path takes less than {verdict.lower_bound:.5f} s",
        # Reasons can be long; below the table they do not squeeze the numbers.
        caption=escape("\n".join(line for row in verdict.rows for line in _words(verdict, row))),
        caption_justify="left",
        box=SIMPLE_HEAD,
    )
    table.add_column("method", no_wrap=True)
    for heading in (
        "time [s]",
        "beta at\nend [rad]",
        "over\nbest",
        "over\nbound",
        "miss when\ndriven",
        "wall\n[s]",
    ):
        # Units are written [s], which Rich would take for markup.
        table.add_column(escape(heading), justify="right")
    for row in verdict.rows:
        table.add_row(
            row.method,
            _shown(_finite(row.plan.time), ".5f"),
            _shown(_rounded(row.beta_final), ".4f"),
            _shown(_rounded(verdict.gap_to_best(row)), ".2%"),
            _shown(_rounded(verdict.gap_to_bound(row)), ".2%"),
            _shown(row.violation, ".1e"),
            _shown(row.plan.wall_time, ".3f"),
        )
    return table


def _words(verdict: PlanningVerdict, row: Row) -> list[str]:
    """What a planner says, and what it remarks."""
    return [f"{row.method}: {each}" for each in (status_of(verdict, row), *_remarks(row))]


def _remarks(row: Row) -> list[str]:
    """What a planner warns of, where it did without its usual means, what is odd in its path."""
    notes, path = row.plan.notes, row.plan.path
    found: list[str] = []
    for key in ("warnings", "fell_back"):
        said = notes.get(key)
        found += map(str, said) if isinstance(said, list) else []
    overlap = notes.get("overlap")
    if isinstance(overlap, float) and overlap >= _SHOWN_OVERLAP:
        found.append(f"between its nodes the cart is up to {1e3 * overlap:.1f} mm in a wall")
    bent = 0.0 if path is None else float(np.abs(path.states[:, 3]).max())
    if bent > math.pi + _ROUNDING:
        found.append(f"the trailer turns right round its hitch, to {bent:.2f} rad (`--jackknife`)")
    return found


def _row_object(verdict: PlanningVerdict, row: Row) -> dict[str, object]:
    return {
        "time": _finite(row.plan.time),
        "time_to_go": _promised(row),
        "beta_final": row.beta_final,
        "status": status_of(verdict, row),
        "converged": row.holds,
        "optimal_because": reasons(verdict, row),
        "gap_to_best": verdict.gap_to_best(row),
        "gap_to_bound": verdict.gap_to_bound(row),
        "violation": row.violation,
        "miss": None if row.driven is None else list(row.driven.goal_miss),
        "wall_time": row.plan.wall_time,
    }


def _promised(row: Row) -> float | None:
    """What a table promises, beside the time that its path attains [s]."""
    promised = row.plan.notes.get("time_to_go")
    return _finite(promised) if isinstance(promised, float) else None


def _goal_words(verdict: PlanningVerdict) -> str:
    """Which of the different times is meant."""
    goal = verdict.question.goal
    if goal.is_point:
        return "To a point"
    free = [
        name
        for name, width in zip(("x", "y", "theta", "beta"), goal.tolerance, strict=True)
        if math.isinf(width)
    ]
    if free and not any(width for width in goal.tolerance if math.isfinite(width)):
        return f"To a point with {', '.join(free)} free"
    return "Into a box of half-widths " + ", ".join(f"{width:g}" for width in goal.tolerance)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _shown(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _rounded(value: float | None) -> float | None:
    """To four decimals; adding zero makes -0 a 0."""
    return None if value is None else round(value, 4) + 0.0


def write_planning_report(verdict: PlanningVerdict, folder: Path) -> list[str]:
    """Write everything that is known of a verdict; return the names of the files.

    Args:
        verdict: Of some planners.
        folder: Exists.
    """
    names = ["verdict.json", "paths.npz", "paths.png", "replay.html"]
    write_json(folder / names[0], as_object(verdict))
    arrays: dict[str, np.ndarray] = {}
    for row in verdict.rows:
        if row.plan.path is not None:
            arrays[f"{row.method}/times"] = row.plan.path.times
            arrays[f"{row.method}/states"] = row.plan.path.states
            arrays[f"{row.method}/controls"] = row.plan.path.controls
    np.savez_compressed(folder / names[1], **arrays)  # type: ignore[arg-type]  # none is called allow_pickle
    save_paths_picture(folder / names[2], verdict)
    write_planning_replay(folder / names[3], verdict)
    if arrays:
        save_states_picture(folder / "states.png", verdict)
        names.append("states.png")
    if save_value_picture(folder / "value.png", verdict):
        names.append("value.png")
    return names

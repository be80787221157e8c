"""A schedule's summary as tables for the terminal."""

import math
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Group
from rich.table import Table
from rich.text import Text

# Unit and meaning of the entries that are one number.
ROWS = {
    "travel_time": ("s", "asked for, between neighbours"),
    "travel_time_max": ("s", "at most; negative: none would do"),
    "travel_scale_max": ("", "factor by which all driving could be slower"),
    "combines_max": ("", "floor(r_u / r_f), for one cart"),
    "period": ("s", "from a combine's start of unloading to its next"),
    "period_min": ("s", "of a cart that never waits"),
    "jitter": ("", "part by which each time may be longer in this plan"),
    "jitter_max": ("", "the same for a cart that never waits"),
}
_CHANGES = {
    "travel_time": ("s", "at most"),
    "capacity": ("kg", "at least"),
    "fill_rate": ("kg/s", "at most"),
    "unload_rate": ("kg/s", "at least"),
    "cart_capacity": ("kg", "at least"),
    "truck_travel_time": ("s", "at most"),
}


def schedule_tables(summary: dict[str, Any]) -> Group:
    """The answer, its numbers, then either the visits or what to change."""
    verdict = "feasible" if summary["feasible"] else "not feasible"
    parts: list[Table | Text] = [Text(f"Schedule of {_who(summary)}: {verdict}", style="bold")]
    parts += [Text(f"{reason}.") for reason in summary["reasons"]]
    if summary["certificate"] is not None:
        parts.append(Text(f"Certificate: {summary['certificate']['says']}."))
    parts.append(_numbers(summary))
    if summary["feasible"]:
        parts.append(_combines(summary))
    else:
        parts.append(_changes(summary["remedies"]))
    return Group(*parts)


def _who(summary: dict[str, Any]) -> str:
    carts, combines = summary["carts_used"], summary["combines"]
    return (
        f"{combines} combine{'s' if combines > 1 else ''}"
        f" and {carts} cart{'s' if carts > 1 else ''}"
    )


def _numbers(summary: dict[str, Any]) -> Table:
    table = Table(box=SIMPLE_HEAD)
    for heading, side in (("", "left"), ("value", "right"), ("unit", "left"), ("meaning", "left")):
        table.add_column(heading, justify="right" if side == "right" else "left")
    for key, (unit, meaning) in ROWS.items():
        if summary[key] is not None:
            table.add_row(key, f"{summary[key]:.6g}", unit, meaning)
    for name, constraint in summary["constraints"].items():
        mark = " (binding)" if name in summary["binding"] else ""
        slack = constraint["slack"]
        nothing = "none" if name in summary["binding"] and not summary["feasible"] else "any"
        shown = nothing if slack is None else f"{slack:.4g}"
        table.add_row(f"slack of {name}", shown, constraint["unit"], constraint["says"] + mark)
    return table


def _combines(summary: dict[str, Any]) -> Table:
    table = Table(box=SIMPLE_HEAD)
    for heading in ("combine", "cart", "first load [kg]", "later loads [kg]", "wait [s]"):
        # Units are written [s], which Rich would take for markup.
        table.add_column(Text(heading), justify="right")
    cart_of = {n: k for k, cart in enumerate(summary["carts"]) for n in cart["combines"]}
    for n in range(summary["combines"]):
        numbers = (
            summary["loads_at_start"][n],
            summary["loads_when_served"][n],
            summary["waiting_times"][n],
        )
        table.add_row(str(n), str(cart_of[n]), *(f"{number:.6g}" for number in numbers))
    return table


def _changes(remedies: dict[str, Any]) -> Table:
    table = Table(title="Change one of these", title_justify="left", box=SIMPLE_HEAD)
    for heading in ("", "", "value", "unit", "factor"):
        table.add_column(heading, justify="right" if heading in ("value", "factor") else "left")
    for name, (unit, bound) in _CHANGES.items():
        if name not in remedies:
            continue
        change = remedies[name]
        if change is None:
            table.add_row(name, "no value will do")
            continue
        value = "" if change["value"] is None else f"{_rounded(change['value'], bound):.6g}"
        table.add_row(name, bound, value, unit, f"{_rounded(change['factor'], bound):.6g}")
    table.add_row("combines", "at most", str(remedies["combines"]))
    carts = remedies["carts"]
    more = f"more than {remedies['carts_more_than']}" if carts is None else ""
    table.add_row("carts", more or "at least", "" if carts is None else str(carts))
    return table


def _rounded(value: float, bound: str) -> float:
    """Six digits towards the side that still works."""
    if value == 0:
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 5)
    # What bisection left open must not cost a whole digit.
    steps = value / unit
    near = round(steps)
    if abs(steps - near) < 1e-4:
        return near * unit
    return unit * (math.floor(steps) if bound == "at most" else math.ceil(steps))

"""`sightfield harvest audit`: what a log says that machines did, against what they may do."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ...systems.numerics.harvest.audit.audit import GAP, HarvestAudit, audit_harvest
from ...systems.numerics.harvest.audit.harvest_log import AuditFault, read_harvest
from ...systems.numerics.units import area_text

# Units of the figures; those that are not here have none.
UNITS = {
    "duration": "s",
    "field_area": "m^2",
    "min_combine_to_combine": "m",
    "min_cart_to_combine": "m",
    "min_cart_to_cart": "m",
    "min_to_obstacle": "m",
    "beyond_margin": "m^2",
    "crop_under_bodies": "m^2",
    "combine_acceleration": "m/s^2",
    "combine_lateral_acceleration": "m/s^2",
    "cart_acceleration": "m/s^2",
    "cart_lateral_acceleration": "m/s^2",
    "grain_harvested": "kg",
    "grain_delivered": "kg",
    "grain_left": "kg",
    "grain_error": "kg",
}

# Of the faults of a kind so many are printed; `--json` has all.
SHOWN = 8


def audit(
    folder: Annotated[Path, typer.Argument(help="With log.npz and machines.json.")],
    gap: Annotated[float, typer.Option(help="Least distance between two machines [m].")] = GAP,
    as_json: Annotated[bool, typer.Option("--json", help="Print the audit as JSON.")] = False,
) -> None:
    """Look in the log of a harvest for machines too near, crop under bodies, and lost grain.

    Exit code 0: nothing is wrong; 1: something is, and is listed; 2: the files cannot be read.
    """
    found = audit_harvest(*read_harvest(folder), gap)
    if as_json:
        print(json.dumps(_as_json(found), indent=2))
    else:
        _show(found)
    if not found.passed:
        raise typer.Exit(1)


def _as_json(found: HarvestAudit) -> dict[str, object]:
    faults = [{**fault._asdict(), "says": _line(fault)} for fault in found.faults]
    return {"passed": found.passed, **found.figures, "faults": faults}


def shown(value: object, unit: str) -> tuple[str, str]:
    """A figure and its unit for a table; areas are told in hectares unless they are small."""
    if isinstance(value, float) and unit == "m^2":
        number, said = area_text(value).split(" ")
        return number, said
    text = "-" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)
    return text, unit


def figures_table(figures: Mapping[str, object], units: Mapping[str, str]) -> Table:
    """Figures with their units, one below the other.

    Args:
        figures: Values by their names.
        units: Of those that have one.
    """
    table = Table(show_header=False, box=None, padding=(0, 2))
    for name, value in figures.items():
        table.add_row(name.replace("_", " "), *shown(value, units.get(name, "")))
    return table


def _show(found: HarvestAudit) -> None:
    Console().print(figures_table(found.figures, UNITS))
    # A fault is one line, however narrow the terminal.
    for kind in dict.fromkeys(fault.kind for fault in found.faults):
        alike = [fault for fault in found.faults if fault.kind == kind]
        for fault in alike[:SHOWN]:
            print(_line(fault))
        if len(alike) > SHOWN:
            print(f"{kind}: {len(alike) - SHOWN} more, which --json lists")
    print("The audit finds nothing wrong." if found.passed else "The audit FAILS.")


def _line(fault: AuditFault) -> str:
    who = f"{' and '.join(fault.machines)}: " if fault.machines else ""
    return (
        f"{fault.begin:.1f} to {fault.end:.1f} s: {who}{fault.kind}; {fault.amount:.4g} "
        f"{fault.unit} at {fault.time:.2f} s, limit {fault.limit:.4g}"
    )

"""`sightfield standoff`: keep a distance by a biased estimate, and say what can come of it."""

import json
import math
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ...systems.numerics.standoff.equilibria import singularities
from ...systems.numerics.standoff.error_model import ErrorModel
from ...systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop
from ...systems.numerics.standoff.response import require_start
from ..outputs import output_folder
from ..standoff.analysis import StandoffAnalysis, analyse_standoff
from ..standoff.report import ROWS, standoff_report, write_report

THESIS = ErrorModel()


def standoff(
    controller: Annotated[str, typer.Option(help=f"One of {', '.join(CONTROLLERS)}.")] = "PID",
    kp: Annotated[float, typer.Option(help="Proportional gain [1/s].")] = 10.0,
    ki: Annotated[float, typer.Option(help="Integral gain [1/s^2].")] = 5.0,
    kd: Annotated[float, typer.Option(help="Derivative gain [1].")] = 1.0,
    start: Annotated[float, typer.Option(help="True distance at the start [m].")] = 0.1,
    reference: Annotated[float, typer.Option(help="Distance to keep [m].")] = 0.2,
    a: Annotated[float, typer.Option(help="Error's curvature [1/m].")] = THESIS.a,
    b: Annotated[float, typer.Option(help="Error's slope at zero distance [1].")] = THESIS.b,
    c: Annotated[float, typer.Option(help="Error at zero distance [m].")] = THESIS.c,
    analyse: Annotated[
        bool,
        typer.Option("--analyse", help="Equilibria, poles, singularities, region, margins."),
    ] = False,
    out: Annotated[
        Path | None, typer.Option(help="Folder to leave JSON, plots and replay.html in.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object and nothing else.")
    ] = False,
) -> None:
    """A pursuer keeps its distance to an evader that it sees with error e(y) = a y^2 + b y + c.

    Everything is in metres and seconds; the thesis has millimetres: a = 0.001062 1/mm, c = 137 mm.
    """
    loop = StandoffLoop(
        controller=controller,
        kp=kp,
        ki=ki,
        kd=kd,
        reference=reference,
        error=ErrorModel(a=a, b=b, c=c),
    )
    require_start(loop, start)
    found = analyse_standoff(loop) if analyse else None
    report = None if found is not None and out is None else standoff_report(loop, start)
    written: list[str] = []
    with output_folder(out) if out is not None else nullcontext() as folder:
        if folder is not None and report is not None:
            written = write_report(folder, loop, report, found)
    if as_json:
        said = found.as_object() if found is not None else report.summary if report else {}
        typer.echo(json.dumps(said, indent=2))
        return
    console = Console()
    if found is not None:
        console.print(_analysis_table(found))
    if report is not None:
        console.print(_summary_table(report.summary))
    if out is not None:
        console.print(f"Wrote {', '.join(written)} to [bold]{out}[/]")


def _summary_table(summary: dict[str, object]) -> Table:
    table = Table(title="Stand-off")
    for heading in ("", "value", "unit", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    for key, value in summary.items():
        if value is not None:
            shown = f"{value:.5g}" if isinstance(value, float) else str(value)
            table.add_row(key, shown, *ROWS[key])
    return table


def _analysis_table(found: StandoffAnalysis) -> Table:
    table = Table(title=f"Stand-off, {found.loop.controller}: analysis", show_header=False)
    for each in found.equilibria:
        poles = ", ".join(_pole(pole) for pole in each.poles)
        kind = "stable" if each.stable else "unstable"
        if each.stable and not each.realisable:
            kind = "stable in the equation, but any filtered derivative runs away"
        table.add_row(f"equilibrium {each.y:.6f} m", f"{kind}; poles {poles} 1/s")
    table.add_row("bias", f"{found.bias:+.6f} m at the wanted equilibrium")
    for y in singularities(found.loop):
        table.add_row(f"singularity {y:.6f} m", "1 - K_D f'(y) = 0")
    rows = {
        "region of attraction": (found.region.low, found.region.high, "integral empty"),
        "region from y' = 0": (
            found.region_at_rest.low,
            found.region_at_rest.high,
            "as the thesis",
        ),
        "certified by the energy": (*found.energy_interval, "closed form"),
    }
    if found.certificate is not None:
        sure = (found.certificate.low, found.certificate.high, "Drake")
        rows["certified by sums of squares"] = sure
    if not found.loop.integrates:
        del rows["region from y' = 0"]
    for name, (low, high, remark) in rows.items():
        table.add_row(name, f"{_end(low)} to {_end(high)} ({remark})")
    margin, filtered = found.margin, found.filtered_margin
    table.add_row("delay margin", f"{1000 * margin.delay:.4g} ms")
    if found.loop.derivative_gain:
        words = f"{1000 * filtered.delay:.4g} ms, derivative filtered by "
        table.add_row("", f"{words}{1000 * found.filter_time:g} ms")
    for each in found.held:
        place = "inside" if each.calibrated else "outside"
        kind = "stable" if each.stable else "unstable"
        table.add_row(f"held equilibrium {each.y:.4f} m", f"{kind}, {place} the calibrated range")
    table.caption = "held: with the estimate's error held at the ends of the calibrated range"
    return table


def _pole(pole: complex) -> str:
    return f"{pole.real:.6g}" if pole.imag == 0 else f"{pole.real:.6g}{pole.imag:+.6g}j"


def _end(end: float) -> str:
    if math.isfinite(end):
        return f"{end:.6f} m"
    return "unbounded below" if end < 0 else "unbounded above"

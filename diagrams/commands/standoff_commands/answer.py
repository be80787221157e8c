"""What `sightfield standoff` and its `analyse` print and write."""

import json
import math
from contextlib import nullcontext
from pathlib import Path

import typer
from rich.console import Console
from rich.table import Table

from ...outputs import output_folder
from ...standoff.analysis import StandoffAnalysis, analyse_standoff
from ...standoff.make_standoff import StandoffScenario
from ...standoff.report import ROWS, StandoffReport, standoff_report, write_standoff_report


def analyse_and_answer(scenario: StandoffScenario, out: Path | None, as_json: bool) -> None:
    """Analyse a scenario, and follow its start if a folder is to be written.

    Args:
        scenario: What is analysed.
        out: Where JSON, pictures and replay go.
        as_json: Whether to print JSON in place of tables.
    """
    found = analyse_standoff(scenario.loop, scenario.sampled, scenario.delay_samples)
    answer(None if out is None else standoff_report(scenario), found, out, as_json)


def answer(
    report: StandoffReport | None, found: StandoffAnalysis | None, out: Path | None, as_json: bool
) -> None:
    """Print and write a report, an analysis, or both.

    Args:
        report: Of a start; there is one if there is no analysis or `out`.
        found: The analysis, if that was asked for.
        out: Where JSON, pictures and replay go.
        as_json: Whether to print JSON in place of tables.
    """
    written: list[str] = []
    with output_folder(out) if out is not None else nullcontext() as folder:
        if folder is not None and report is not None:
            written = write_standoff_report(folder, report, found)
    if as_json:
        said = found.as_object() if found is not None else report.summary if report else {}
        typer.echo(json.dumps(said, indent=2))
        return
    console = Console()
    if found is not None:
        console.print(_analysis_table(found))
    if report is not None:
        console.print(summary_table(report.summary))
    if out is not None:
        console.print(f"Wrote {', '.join(written)} to [bold]{out}[/]")


def summary_table(
    summary: dict[str, object],
    rows: dict[str, tuple[str, str]] = ROWS,
    title: str = "Stand-off",
) -> Table:
    """A summary with units and meanings.

    Args:
        summary: What `ROWS` or `rows` describes.
        rows: Unit and meaning of each entry.
        title: Of the table.
    """
    table = Table(title=title)
    for heading in ("", "value", "unit", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    for key, value in summary.items():
        if value is not None:
            shown = f"{value:.5g}" if isinstance(value, float) else str(value)
            table.add_row(key, shown, *rows[key])
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
    for y in found.singularities:
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
    if found.sampled_region is not None:
        ends = (found.sampled_region.low, found.sampled_region.high)
        rows["region of the sampled loop"] = (*ends, "delay, limit and filter included")
    for name, (low, high, remark) in rows.items():
        table.add_row(name, f"{_end(low)} to {_end(high)} ({remark})")
    margin, filtered = found.margin, found.filtered_margin
    table.add_row("delay margin", f"{1000 * margin.delay:.4g} ms")
    if found.loop.derivative_gain:
        words = f"{1000 * filtered.delay:.4g} ms, derivative filtered by "
        table.add_row("", f"{words}{1000 * found.sampled.filter_time:g} ms")
    table.add_row(*_sampled_words(found))
    for each in found.held:
        place = "inside" if each.calibrated else "outside"
        kind = "stable" if each.stable else "unstable"
        table.add_row(f"held equilibrium {each.y:.4f} m", f"{kind}, {place} the calibrated range")
    table.caption = "held: with the estimate's error held at the ends of the calibrated range"
    return table


def _sampled_words(found: StandoffAnalysis) -> tuple[str, str]:
    margins, period = found.sampled_margins, found.sampled.period
    name = f"sampled by {1000 * period:g} ms"
    if found.delay_samples:
        name += f", {1000 * period * found.delay_samples:g} ms late"
    if not margins.stable:
        return name, f"unstable; slowest pole |z| = {abs(margins.poles[0]):.4g}"
    return name, (
        f"gain margin {margins.gain_margin:.3g}, "
        f"phase margin {math.degrees(margins.phase_margin):.1f} degrees, "
        f"delay margin {1000 * margins.delay_margin:.4g} ms, Ms {margins.peak_sensitivity:.3f}"
    )


def _pole(pole: complex) -> str:
    return f"{pole.real:.6g}" if pole.imag == 0 else f"{pole.real:.6g}{pole.imag:+.6g}j"


def _end(end: float) -> str:
    if math.isfinite(end):
        return f"{end:.6f} m"
    return "unbounded below" if end < 0 else "unbounded above"

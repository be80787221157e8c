"""`sightfield standoff`: keep a distance by a biased estimate, and say what can come of it.

All subcommands share the options of one scenario. Without a subcommand `run` is meant, which says
what becomes of one start.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from ...systems.numerics.errors import require, require_non_negative, require_positive
from ...systems.numerics.standoff.loop import CONTROLLERS, ErrorModel, StandoffLoop
from ...systems.numerics.standoff.response import require_start
from ...systems.numerics.standoff.sampled_loop import SampledPid, Specification, design_gains
from ..outputs import optional_folder, write_json
from ..standoff.analysis import MARGINS, StandoffAnalysis, analyse_standoff
from ..standoff.laboratory import StandoffPage
from ..standoff.make_standoff import StandoffScenario, run_standoff
from ..standoff.report import (
    EVADER_SPEED,
    EVADER_SWAY,
    ROWS,
    StandoffReport,
    standoff_report,
    write_standoff_report,
)
from ..standoff.simulation import ROWS as SIMULATION_ROWS
from ..standoff.simulation import simulation_summary, write_simulation
from ..visuals.live_page import open_live_page
from .shared import JsonOption, RunByDefault, summary_table, takes, tell

THESIS, CLOCK = ErrorModel(), SampledPid()
# A longer delay line makes matrices whose poles take seconds.
MOST_DELAY = 500

OutOption = Annotated[
    Path | None, typer.Option(help="Folder to leave JSON, plots and replay.html in.")
]


def read_scenario(
    controller: Annotated[str, typer.Option(help=f"One of {', '.join(CONTROLLERS)}.")] = "PID",
    kp: Annotated[float, typer.Option(help="Proportional gain [1/s].")] = 10.0,
    ki: Annotated[float, typer.Option(help="Integral gain [1/s^2].")] = 5.0,
    kd: Annotated[float, typer.Option(help="Derivative gain [1].")] = 1.0,
    start: Annotated[float, typer.Option(help="True distance at the start [m].")] = 0.1,
    reference: Annotated[float, typer.Option(help="Distance to keep [m].")] = 0.2,
    a: Annotated[
        float, typer.Option(help="Error's curvature [1/m]; 0: a straight line.")
    ] = THESIS.a,
    b: Annotated[float, typer.Option(help="Error's slope at zero distance [1].")] = THESIS.b,
    c: Annotated[float, typer.Option(help="Error at zero distance [m].")] = THESIS.c,
    period: Annotated[float, typer.Option(help="Time between samples [s].")] = CLOCK.period,
    filter_time: Annotated[
        float, typer.Option(help="Time constant of the derivative's filter [s].")
    ] = CLOCK.filter_time,
    delay: Annotated[
        float, typer.Option(help="Of the estimate [s]; rounded to whole samples.")
    ] = 0.0,
    limit: Annotated[
        float | None, typer.Option(help="Top speed of the pursuer [m/s] [default: none].")
    ] = None,
    noise: Annotated[float, typer.Option(help="Standard deviation of an estimate [m].")] = 0.0,
    seed: Annotated[int, typer.Option(help="Of the noise.")] = 0,
    evader_speed: Annotated[
        float, typer.Option(help="Mean speed of the evader in the block diagram [m/s].")
    ] = EVADER_SPEED,
    evader_sway: Annotated[
        float, typer.Option(help="How much its speed sways about that [m/s].")
    ] = EVADER_SWAY,
    feed_forward: Annotated[
        bool, typer.Option(help="Whether the pursuer knows the evader's velocity.")
    ] = True,
) -> StandoffScenario:
    """The scenario that the options say.

    Raises:
        InvalidInput: A number is out of its range.
    """
    error = ErrorModel(a=a, b=b, c=c)
    loop = StandoffLoop(
        controller=controller, kp=kp, ki=ki, kd=kd, reference=reference, error=error
    )
    sampled = SampledPid(
        period=period, filter_time=filter_time, limit=math.inf if limit is None else limit
    )
    require_non_negative("delay", delay)
    words = f"be at most {MOST_DELAY} samples of {period:g} s"
    require(delay <= MOST_DELAY * period, "delay", words, delay)
    require_start(loop, start)
    return StandoffScenario(
        loop=loop,
        sampled=sampled,
        start=start,
        evader_speed=evader_speed,
        evader_sway=evader_sway,
        feed_forward=feed_forward,
        noise=noise,
        seed=seed,
        delay_samples=round(delay / period),
    )


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
    with optional_folder(out) as folder:
        if folder is not None and report is not None:
            written = write_standoff_report(folder, report, found)
    said = found.as_object() if found is not None else report.summary if report else {}
    shown = [] if found is None else [_analysis_table(found)]
    if report is not None:
        shown.append(summary_table("Stand-off", report.summary, ROWS, digits=5))
    tell(said, *shown, as_json=as_json, written=written, out=out)


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


@takes(read_scenario)
def run(
    scenario: StandoffScenario,
    analyse: Annotated[bool, typer.Option("--analyse", help="As the command `analyse`.")] = False,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """A pursuer keeps its distance to an evader that it sees with error e(y) = a y^2 + b y + c."""
    if analyse:
        analyse_and_answer(scenario, out, as_json)
    else:
        answer(standoff_report(scenario), None, out, as_json)


@takes(read_scenario)
def analyse(scenario: StandoffScenario, out: OutOption = None, as_json: JsonOption = False) -> None:
    """Equilibria, poles, singularities, regions of attraction and margins of a loop.

    Of the ideal loop, and of the loop with this clock, filter, delay and limit.
    """
    analyse_and_answer(scenario, out, as_json)


ASKED = Specification()
DESIGN_ROWS = {
    "controller": ("", "P, PI, PD or PID"),
    "kp": ("1/s", "proportional gain"),
    "ki": ("1/s^2", "integral gain"),
    "kd": ("", "derivative gain"),
    "gain_margin": ("", "factor on all gains that it bears"),
    "phase_margin": ("rad", "lag that it bears"),
    "crossover": ("rad/s", "where the phase margin is taken"),
    "delay_margin": ("s", "further delay that it bears"),
    "peak_sensitivity": ("", "Ms: how much disturbances are amplified at most"),
}


@takes(read_scenario)
def design(
    scenario: StandoffScenario,
    phase_margin: Annotated[float, typer.Option(help="Least phase margin [degrees].")] = 60.0,
    gain_margin: Annotated[float, typer.Option(help="Least gain margin.")] = ASKED.gain_margin,
    peak_sensitivity: Annotated[
        float, typer.Option(help="Largest peak Ms of the sensitivity.")
    ] = ASKED.peak_sensitivity,
    delay_margin: Annotated[
        float, typer.Option(help="Least further delay that it bears [s].")
    ] = ASKED.delay_margin,
    damping: Annotated[
        float, typer.Option(help="Of the ideal PI loop's poles, 1: no overshoot.")
    ] = ASKED.damping,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Choose the fastest gains that keep these margins, with this clock, filter and delay."""
    asked = Specification(
        phase_margin=math.radians(phase_margin),
        gain_margin=gain_margin,
        peak_sensitivity=peak_sensitivity,
        delay_margin=delay_margin,
        damping=damping,
    )
    found = design_gains(scenario.loop, scenario.sampled, scenario.delay_samples, asked)
    loop = found.loop
    said: dict[str, object] = {"controller": loop.controller, "kp": loop.kp}
    if loop.integrates:
        said["ki"] = loop.ki
    if loop.derivative_gain:
        said["kd"] = loop.kd
    for name in MARGINS:
        value = getattr(found.margins, name)
        said[name] = value if math.isfinite(value) else None
    written: list[str] = []
    with optional_folder(out) as folder:
        if folder is not None:
            tuned = replace(scenario, loop=loop)
            analysis = analyse_standoff(loop, scenario.sampled, scenario.delay_samples)
            written = write_standoff_report(folder, standoff_report(tuned), analysis)
            write_json(folder / "design.json", said)
            written.append("design.json")
    title = "Stand-off: gains for the margins asked for"
    table = summary_table(title, said, DESIGN_ROWS, digits=5)
    tell(said, table, as_json=as_json, written=written, out=out)


# So that nobody waits for a slip of the finger.
MOST_SAMPLES = 400_000


@takes(read_scenario)
def simulate(
    scenario: StandoffScenario,
    seconds: Annotated[float, typer.Option(help="How long [s].")] = 10.0,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the block diagram: evader, estimate with noise and delay, sampled law, limit."""
    require_positive("seconds", seconds)
    most = MOST_SAMPLES * scenario.sampled.period
    require(seconds <= most, "seconds", f"be at most {MOST_SAMPLES} samples, {most:g} s", seconds)
    written: list[str] = []
    with optional_folder(out) as folder:
        run = run_standoff(scenario, seconds)
        summary = simulation_summary(scenario, run)
        if folder is not None:
            written = write_simulation(folder, scenario, run, summary)
    table = summary_table("Stand-off: simulation", summary, SIMULATION_ROWS, digits=5)
    tell(summary, table, as_json=as_json, written=written, out=out)


# A finer clock would make every picture wait.
LEAST_PERIOD = 1e-3


@takes(read_scenario)
def live(
    scenario: StandoffScenario,
    port: Annotated[
        int | None, typer.Option(help="Of the page [default: the first free one from 7000].")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="End after so long [s] [default: with the page's Stop].")
    ] = None,
) -> None:
    """Turn K_P, K_I, K_D and the delay on a page; see response, poles, Nyquist and region move."""
    if seconds is not None:
        require_positive("seconds", seconds)
    period = scenario.sampled.period
    require(period >= LEAST_PERIOD, "period", f"be at least {LEAST_PERIOD:g} s", period)
    meshcat = open_live_page(port=port)
    typer.echo(
        f"Turn the gains at {meshcat.web_url()} (Open Controls); its Stop, or Ctrl-C, ends it."
    )
    StandoffPage(meshcat, scenario).serve(seconds)


standoff: Any = typer.Typer(
    cls=RunByDefault,
    help=(
        "Keep a distance by an estimate with error e(y) = a y^2 + b y + c: analyse the loop, "
        "choose gains, simulate, turn them on a page. Without a command: run, whose options "
        "`sightfield standoff run --help` lists. Everything is in metres and seconds; the thesis "
        "has millimetres: a = 0.001062 1/mm, c = 137 mm."
    ),
    invoke_without_command=True,
    rich_markup_mode=None,
)
for command in (run, analyse, design, simulate, live):
    standoff.command()(command)

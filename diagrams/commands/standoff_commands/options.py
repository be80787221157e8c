"""The options that all subcommands of `sightfield standoff` share: one scenario."""

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from ....systems.numerics.errors import require, require_non_negative
from ....systems.numerics.standoff.loop import CONTROLLERS, ErrorModel, StandoffLoop
from ....systems.numerics.standoff.response import require_start
from ....systems.numerics.standoff.sampled_loop import SampledPid
from ...standoff.make_standoff import StandoffScenario
from ...standoff.report import EVADER_SPEED, EVADER_SWAY

THESIS, CLOCK = ErrorModel(), SampledPid()
# A longer delay line makes matrices whose poles take seconds.
MOST_DELAY = 500

OutOption = Annotated[
    Path | None, typer.Option(help="Folder to leave JSON, plots and replay.html in.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]


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


def takes_scenario(command: Callable[..., None]) -> Callable[..., None]:
    """Put the scenario's options before a command's own, and hand it the scenario.

    Args:
        command: Its first parameter is the scenario.
    """
    shared = inspect.signature(read_scenario).parameters
    own = list(inspect.signature(command).parameters.values())[1:]

    def run(**given: Any) -> None:
        words = {name: given.pop(name) for name in shared}
        command(read_scenario(**words), **given)

    every = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in (*shared.values(), *own)]
    # What Typer reads.
    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__annotations__ = {each.name: each.annotation for each in every}
    run.__signature__ = inspect.Signature(every)
    return run

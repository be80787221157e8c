"""`sightfield standoff live`: a page with sliders for the gains."""

from typing import Annotated

import typer

from ....systems.numerics.errors import require, require_positive
from ...standoff.laboratory import StandoffPage
from ...standoff.make_standoff import StandoffScenario
from ...tracking.live_page import open_live_page
from .options import takes_scenario

# A finer clock would make every picture wait.
LEAST_PERIOD = 1e-3


@takes_scenario
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

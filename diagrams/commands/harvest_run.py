"""`sightfield harvest run`, or without `run`: combines work a field, carts carry the grain away.

The options by which a harvest is asked for are those of the other commands of the harvest too.
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ...systems.numerics.errors import NoPlan, require_non_negative
from ..harvest import scenarios
from ..harvest.job import prepare_harvest
from ..harvest.makers import settings_of_machines
from ..harvest.scenario import HarvestScenario
from ..scenario_files import (
    build,
    builtin_scenarios,
    find_scenario,
    read_tree,
    refuse_doubled,
    with_settings,
)
from .harvest_audit import UNITS as AUDIT_UNITS
from .harvest_audit import figures_table
from .shared import (
    JsonSummaryOption,
    MeshcatOption,
    ReplayOption,
    RunFolderOption,
    WatchedRun,
    with_options,
)

FieldOption = Annotated[
    Path | None,
    typer.Option(help="Harvest this field: WKT, GeoJSON, Shapefile or ISOXML task data."),
]
CoordinatesOption = Annotated[
    str | None,
    typer.Option(help="Of the field's file: wgs84, in degrees [default], or metres."),
]
PartOption = Annotated[
    int | None, typer.Option(help="Of a file with several parts: which one, from 1.")
]
YieldsOption = Annotated[
    Path | None,
    typer.Option(help="What grows where: GeoJSON or an ESRI ASCII grid [t/ha]."),
]
CombinesOption = Annotated[int | None, typer.Option(help="Number of combines.")]
CartsOption = Annotated[int | None, typer.Option(help="Number of carts.")]
SettingOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help='Set a key, as carts.speed=4 or "carts.speed=15 km/h".',
    ),
]


def asked_scenario(
    scenario: str,
    settings: Sequence[str],
    field: Path | None = None,
    coordinates: str | None = None,
    part: int | None = None,
    *,
    combines: int | None = None,
    carts: int | None = None,
    strategy: str | None = None,
    density: str | None = None,
    yields: Path | None = None,
) -> tuple[HarvestScenario, Path]:
    """A scenario as options change it, and the folder that files are looked for in.

    Args:
        scenario: Name of a built-in one, or a file.
        settings: `key=value`, of the scenario.
        field, coordinates, part: See `FieldOption`, `CoordinatesOption` and `PartOption`.
        combines, carts: How many.
        strategy: Of the visits.
        density: Of the crop, with a unit or in [kg/m^2].
        yields: See `YieldsOption`.

    Raises:
        InvalidInput: A file or a key is not there, or a value is out of its range.
    """
    options = {
        "--field": ("field.file", None if field is None else json.dumps(str(field))),
        "--coordinates": ("field.coordinates", coordinates),
        "--part": ("field.part", part),
        "--combines": ("combines.count", combines),
        "--carts": ("carts.count", carts),
        "--strategy": ("strategy", strategy),
        "--yield": ("density", density),
        "--yields": ("yields.file", None if yields is None else json.dumps(str(yields.resolve()))),
    }
    every = with_options(settings, options)
    # Before the figures of machines, whose keys nobody said.
    refuse_doubled(every)
    path = find_scenario(scenario, scenarios)
    # What a machine has is not set by anybody: it may be named, and then changed.
    tree = with_settings(read_tree(path), settings_of_machines(settings))
    folder = path.parent if field is None else Path()
    return build(HarvestScenario, with_settings(tree, every)), folder


# Units of what is printed; what is not here has none.
_UNITS = {
    **AUDIT_UNITS,
    "makespan": "s",
    "makespan_planned": "s",
    "combine_wait_time": "s",
    "combine_stop_time": "s",
    "grain_in_carts": "kg",
    "grain_in_tanks": "kg",
    "grain_lost": "kg",
    "overflow_time": "s",
    "load_deviation": "tanks",
    "latest": "s",
    "wall_time": "s",
}


def run(
    scenario: Annotated[
        str,
        typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios(scenarios))}."),
    ] = "thesis_2",
    field: FieldOption = None,
    coordinates: CoordinatesOption = None,
    part: PartOption = None,
    yields: YieldsOption = None,
    combines: CombinesOption = None,
    carts: CartsOption = None,
    strategy: Annotated[str | None, typer.Option(help="sequential or on-demand.")] = None,
    setting: SettingOption = None,
    out: RunFolderOption = None,
    as_json: JsonSummaryOption = False,
    meshcat: MeshcatOption = None,
    replay: ReplayOption = True,
    realtime: Annotated[
        float, typer.Option(help="Simulated seconds per second, 0: as fast as possible.")
    ] = 0.0,
) -> None:
    """Combines harvest a field, carts unload them on the way, all by a plan made before.

    Exit code 0: all is harvested and delivered; 1: there is no plan, or the run did not finish,
    with the reason; 2: bad input.
    """
    # They load Drake, which takes longer than the audit beside this command.
    from ..harvest.report import summarise_harvest, write_harvest_report
    from ..harvest.run import run_harvest

    require_non_negative("--realtime", realtime)
    asked, folder = asked_scenario(
        scenario,
        setting or [],
        field,
        coordinates,
        part,
        combines=combines,
        carts=carts,
        strategy=strategy,
        yields=yields,
    )
    watched = WatchedRun(out, as_json=as_json, meshcat=meshcat, replay=replay)
    with watched.folder() as written_to:
        with watched.bar() as bar:
            task = bar.add_task("plan", total=1.0)

            def planned(stage: str, share: float) -> None:
                # How far a stage has come that cannot tell is not shown as a share.
                bar.update(
                    task,
                    description=f"plan: {stage}",
                    completed=share,
                    total=1.0 if share > 0 else None,
                )

            try:
                job = prepare_harvest(asked, folder, planned)
            except NoPlan as error:
                bar.stop()
                print(f"no plan: {error}", file=sys.stderr)
                raise typer.Exit(1) from None
            bar.update(task, description="harvested", total=1.0)
            done = run_harvest(
                job,
                watched.page(),
                recording=watched.recording,
                realtime_rate=realtime,
                progress=lambda share: bar.update(task, completed=share),
            )
        name = Path(scenario).stem if field is None else f"{Path(scenario).stem} on {field.stem}"
        summary = summarise_harvest(done, name)
        written = write_harvest_report(done, summary, written_to) if written_to is not None else []
    notes = [f"Note: {reason}." for reason in job.answer.reasons]
    notes.append(
        f"Machines turn and drive on {job.field.margin:g} m outside of the boundary (field.margin)."
    )
    watched.tell(summary, written, figures_table(summary, _UNITS), *notes)
    if not done.finished:
        print(f"not finished: {done.stopped}", file=sys.stderr)
    watched.stay()
    if not done.finished:
        raise typer.Exit(1)

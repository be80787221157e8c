"""Figure 2.5: the pursuit field among polygons, by each of the three risk vectors."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.geometry.world import World
from ....systems.numerics.tracking.corner_fields import FIELDS
from ....systems.numerics.tracking.corner_game import corner_table
from ....systems.numerics.tracking.risk import RISK_VECTORS
from ....systems.numerics.tracking.team_pursuit import sample_field
from ...scenario_files import find_scenario, load_scenario
from ...tracking.scenario import TrackingScenario
from ...world_picture import draw_world
from ..evidence import Evidence, Exhibit, Finding, Picture, Workshop, judged

THESIS = ("uniform", "majority", "proportional")
# Fewer arrows than this along a side hide the field, more blacken it.
ARROWS = 27
# Directions closer than this look the same [rad].
ALIKE = np.radians(5.0)


def _make(workshop: Workshop) -> Evidence:
    scenario = load_scenario(TrackingScenario, find_scenario("risk_vectors"))
    world, evader = scenario.world.load(), np.array(scenario.evaders.positions[0])
    (x, y), points = evader.tolist(), _places(world)
    fields = {
        name: sample_field(
            build_edge_index(world),
            points,
            x,
            y,
            corner_table(world),
            FIELDS["margin"],
            RISK_VECTORS[name],
            scenario.speed_ratio,
        )
        for name in THESIS
    }
    file = workshop.pictures / "figure_2_5.png"
    _draw(file, world, evader, points, fields)
    moving = np.all([np.hypot(*field.T) > 0 for field in fields.values()], axis=0)
    parts = []
    for first, second in (("uniform", "majority"), ("uniform", "proportional"), THESIS[1:]):
        cosine = np.sum(fields[first][moving] * fields[second][moving], axis=1)
        share = np.mean(np.arccos(np.clip(cosine, -1, 1)) > ALIKE)
        parts.append(f"{first} and {second} in {share:.0%}")
    return Evidence(
        (Picture(file, "Where a pursuer would run for the red evader, from each place."),),
        (
            Finding(
                "Three risk vectors, three fields",
                "The techniques generate different vector fields in one environment.",
                f"They differ by more than 5 degrees: {', '.join(parts)} of the "
                f"{moving.sum()} places from which a corner threatens. (Where one corner threatens "
                "alone they cannot.)",
                judged(all(not part.endswith(" 0%") for part in parts)),
            ),
        ),
    )


def _places(world: World) -> np.ndarray:
    low, high = world.bounds[:2], world.bounds[2:]
    steps = (np.arange(ARROWS) + 0.5) / ARROWS
    x, y = (low[k] + steps * (high[k] - low[k]) for k in range(2))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _draw(
    file: Path, world: World, evader: np.ndarray, points: np.ndarray, fields: dict[str, np.ndarray]
) -> None:
    figure = Figure(figsize=(15, 5.3), layout="constrained")
    for axes, (name, field) in zip(figure.subplots(1, 3), fields.items(), strict=True):
        draw_world(axes, world)
        moving = np.hypot(*field.T) > 0
        axes.quiver(
            *points[moving].T,
            *field[moving].T,
            color="#215fcc",
            pivot="mid",
            angles="xy",
            scale_units="xy",
            scale=ARROWS / 3.4,
            width=0.004,
        )
        axes.plot(*evader, "s", color="#d92e33", markersize=9)
        axes.set_title(f"{name} risk")
    figure.savefig(file, dpi=100)


VECTOR_FIELDS = Exhibit(
    id="figure-2.5",
    covers=("Figure 2.5",),
    title="Vector fields of the risk vectors",
    states="Three fields in an environment with polygons, for uniform, majority and proportional "
    "risk (2.2). The environment is not described; ours is the arena of 2.2.8.",
    command="sightfield reproduce --only figure-2.5",
    make=_make,
)

"""What a study is made of: a scenario, a grid of cells that change it, runs, a root seed."""

import re
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any

import yaml

from ...systems.numerics.checked import Checked, Count
from ...systems.numerics.errors import InvalidInput, require, require_positive
from ...systems.numerics.geometry.random_arena import Arena, draw_arena
from ...systems.numerics.geometry.world import World
from ...systems.numerics.run_seeds import run_seed
from ..scenario_files import build, with_settings
from ..tracking.game import with_random_starts
from ..tracking.scenario import TrackingScenario
from ..world_source import WorldSource

_NAME = re.compile(r"[A-Za-z0-9_.,+-]+")


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One way to play: what it changes in the study's scenario.

    Raises:
        InvalidInput: The name is none.
    """

    # Unique in the study: letters, digits and _ . , + -
    name: str
    # "key=value" settings, as of `sightfield track --set`.
    settings: tuple[str, ...] = ()
    # Runs, where fewer than the study's; they are the first of those that other cells have.
    runs: int | None = None

    def __post_init__(self) -> None:
        fine = bool(_NAME.fullmatch(self.name))
        require(fine, "cell", "be named by letters, digits and _ . , + -", repr(self.name))

    def value(self, key: str) -> object:
        """What the cell sets a key to, or None."""
        values = [each.partition("=")[2] for each in self.settings if each.startswith(f"{key}=")]
        return yaml.safe_load(values[-1]) if values else None


@dataclass(frozen=True, kw_only=True)
class Study(Checked):
    """A grid of cells, each played a number of times from random starts in random worlds.

    Run r has the same seed in every cell, and so the same world and, for teams of the same sizes,
    the same starts: cells are compared on common random numbers. With as many pursuers, the
    evaders of a smaller team are the first ones of a larger team.

    Raises:
        InvalidInput: A number is out of its range, cells share a name, or a setting is none.
    """

    # What to call it.
    name: str
    # What every cell starts from; its own starts are not used.
    base: TrackingScenario
    # The grid.
    cells: tuple[Cell, ...]
    # Runs of each cell that has no number of its own.
    runs: Annotated[int, require_positive]
    # Root of all seeds.
    seed: Count = 0
    # How each run's world is drawn; None: the scenario's own world.
    arena: Arena | None = field(default_factory=Arena)
    # Runs one after the other that share a drawn world, and what is computed once for it.
    starts_per_arena: Annotated[int, require_positive] = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        require(len(self.cells) > 0, "cells", "hold one at least", "none")
        names = [cell.name for cell in self.cells]
        twice = sorted({name for name in names if names.count(name) > 1})
        require(not twice, "cells", "have a name each", f"{', '.join(twice)} twice")
        for cell in self.cells:
            cell_scenario(self, cell)
            require(
                cell.runs is None or 0 < cell.runs <= self.runs,
                "cell",
                f"have 1 to {self.runs} runs, all that the study has",
                f"{cell.runs} in cell {cell.name}",
            )

    def runs_of(self, cell: Cell) -> int:
        """How many runs a cell has.

        Args:
            cell: One of the study's.
        """
        return self.runs if cell.runs is None else cell.runs

    def games(self, start: int, stop: int) -> int:
        """How many games the runs from start to stop are, in all cells that have them.

        Args:
            start, stop: Numbers of runs.
        """
        return sum(max(0, min(stop, self.runs_of(cell)) - start) for cell in self.cells)

    def cell(self, name: str) -> Cell:
        """The cell of a name.

        Raises:
            InvalidInput: There is none.
        """
        for cell in self.cells:
            if cell.name == name:
                return cell
        known = ", ".join(cell.name for cell in self.cells)
        raise InvalidInput(f"`cell` must be one of {known}; got {name}")

    def scenario(self, cell: Cell, run: int) -> TrackingScenario:
        """The game of one run, complete: it can be played alone.

        Raises:
            InvalidInput: There is no such run; the arena has no room for its obstacles.
        """
        runs = self.runs_of(cell)
        require(0 <= run < runs, "run", f"lie between 0 and {runs - 1}", run)
        seed = run_seed(self.seed, run)
        return in_world(cell_scenario(self, cell), self.drawn_world(run), seed)

    def drawn_world(self, run: int) -> World | None:
        """The random world of a run; None where the scenario's own is played.

        Args:
            run: Number of the run.

        Raises:
            InvalidInput: The arena has no room for its obstacles.
        """
        if self.arena is None:
            return None
        return draw_arena(self.arena, run_seed(self.seed, run // self.starts_per_arena))


def cell_scenario(study: Study, cell: Cell) -> TrackingScenario:
    """The scenario of a cell, before a run has given it world and seed.

    Raises:
        InvalidInput: A setting does not fit the scenario.
    """
    try:
        tree = with_settings(asdict(with_random_starts(study.base)), cell.settings)
        return build(TrackingScenario, tree)
    except InvalidInput as error:
        raise InvalidInput(f"{error} (in cell {cell.name})") from None


def in_world(scenario: TrackingScenario, world: World | None, seed: int) -> TrackingScenario:
    """The scenario with a seed and, if one is given, in a drawn world."""
    if world is None:
        return replace(scenario, seed=seed)
    rings = [ring.tolist() for ring in world.obstacles]
    source = WorldSource(boundary=world.boundary.tolist(), obstacles=rings)
    return replace(scenario, seed=seed, world=source)


def study_to_json(study: Study) -> dict[str, Any]:
    """The study as JSON can hold it."""
    tree = asdict(study)
    tree["cells"] = [{**cell, "settings": list(cell["settings"])} for cell in tree["cells"]]
    return tree


def study_from_json(tree: Any) -> Study:
    """The study that `study_to_json` wrote.

    Args:
        tree: As JSON has it.

    Raises:
        InvalidInput: It is none.
    """
    return build(Study, tree)

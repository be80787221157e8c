"""What a study leaves in its folder beside its table: numbers and pictures."""

import json
from dataclasses import asdict
from pathlib import Path

import yaml

from ..tracking.scenario import TrackingScenario
from .grid import StudyGrid
from .pictures import draw_curves, draw_matrix, draw_means
from .records import StudyResult
from .tables import mean_tables, to_markdown


def write_study_report(
    result: StudyResult, grid: StudyGrid, summary: dict[str, object], folder: Path
) -> list[str]:
    """Write numbers and pictures of a finished study; return the names of the files.

    Args:
        result: A finished study.
        grid: What is drawn with what; what it has nothing of is not drawn.
        summary: From `summarise_study`.
        folder: Exists.
    """
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    tables = to_markdown(mean_tables(summary, grid))
    (folder / "tables.md").write_text(tables, encoding="utf-8")
    pictures = {
        "means.png": (grid.means, draw_means),
        "matrix.png": (grid.matrix, draw_matrix),
        "curves.png": (grid.curves, draw_curves),
    }
    names = [name for name, (shown, _) in pictures.items() if shown]
    for name in names:
        pictures[name][1](result, grid).savefig(folder / name, dpi=120)
    return ["summary.json", "tables.md", *names]


def write_scenario(scenario: TrackingScenario, file: Path) -> None:
    """Write a scenario that `sightfield track` plays."""
    file.write_text(yaml.safe_dump(asdict(scenario), sort_keys=False), encoding="utf-8")

"""What a study leaves in its folder beside its table: numbers and pictures."""

import json
from dataclasses import asdict
from pathlib import Path

import yaml

from ..tracking.scenario import TrackingScenario
from .grid import Grid
from .pictures import draw_curves, draw_means
from .records import StudyResult


def write_study_report(
    result: StudyResult, grid: Grid, summary: dict[str, object], folder: Path
) -> list[str]:
    """Write numbers and pictures of a finished study; return the names of the files.

    Args:
        result: A finished study.
        grid: What is drawn with what.
        summary: From `summarise`.
        folder: Exists.
    """
    names = ["summary.json", "means.png", "curves.png"]
    (folder / names[0]).write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    draw_means(result, grid).savefig(folder / names[1], dpi=120)
    draw_curves(result, grid).savefig(folder / names[2], dpi=120)
    return names


def write_scenario(scenario: TrackingScenario, file: Path) -> None:
    """Write a scenario that `sightfield track` plays."""
    file.write_text(yaml.safe_dump(asdict(scenario), sort_keys=False), encoding="utf-8")

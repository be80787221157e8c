"""What a verdict leaves in a folder: numbers, paths, pictures, a replay."""

import json
from pathlib import Path

import numpy as np

from .pictures.plan_picture import save_paths_picture, save_states_picture
from .pictures.replay import write_planning_replay
from .pictures.value_picture import save_value_picture
from .verdict import PlanningVerdict
from .verdict_table import as_object


def write_planning_report(verdict: PlanningVerdict, folder: Path) -> list[str]:
    """Write everything that is known of a verdict; return the names of the files.

    Args:
        verdict: Of some planners.
        folder: Exists.
    """
    names = ["verdict.json", "paths.npz", "paths.png", "replay.html"]
    text = json.dumps(as_object(verdict), indent=2)
    (folder / names[0]).write_text(text + "\n", encoding="utf-8")
    arrays: dict[str, np.ndarray] = {}
    for row in verdict.rows:
        if row.plan.path is not None:
            arrays[f"{row.method}/times"] = row.plan.path.times
            arrays[f"{row.method}/states"] = row.plan.path.states
            arrays[f"{row.method}/controls"] = row.plan.path.controls
    np.savez_compressed(folder / names[1], **arrays)  # type: ignore[arg-type]  # none is called allow_pickle
    save_paths_picture(folder / names[2], verdict)
    write_planning_replay(folder / names[3], verdict)
    if arrays:
        save_states_picture(folder / "states.png", verdict)
        names.append("states.png")
    if save_value_picture(folder / "value.png", verdict):
        names.append("value.png")
    return names

"""A study on disk: what it is, the blocks that are done, and the table when all are.

`study.json` says what is studied. Each block of runs is one Parquet file in `blocks/`, written
under a temporary name and moved, so that it is whole or not there. The last step joins them into
`table.parquet`, in the order of cells and runs, whatever order they came in.
"""

import json
import os
import shutil
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ...systems.numerics.errors import InvalidInput, require
from ..outputs import refuse
from .play import COLUMNS, Rows
from .study import Study, study_from_json, study_to_json

# Types of the columns, where they are not whole numbers.
_TYPES = {
    "cell": pa.string(),
    "horizon": pa.float64(),
    "time": pa.float64(),
    "censored": pa.bool_(),
}

SCHEMA = pa.schema([(name, _TYPES.get(name, pa.int64())) for name in COLUMNS])


@dataclass(frozen=True, eq=False)
class StudyResult:
    """A finished study.

    Attributes:
        study: What was studied.
        table: One row a game, sorted by cell, then run; columns as in `play.COLUMNS`.
    """

    study: Study
    table: pa.Table

    def rows(self, cell: str) -> pa.Table:
        """The part of the table that a cell has.

        Raises:
            InvalidInput: There is no such cell.
        """
        study, cell_of_name = self.study, self.study.cell(cell)
        before = study.cells[: study.cells.index(cell_of_name)]
        start = sum(study.runs_of(each) for each in before)
        return self.table.slice(start, study.runs_of(cell_of_name))

    def times(self, cell: str) -> np.ndarray:
        """Tracking times of a cell in the order of runs, at most the horizon, shape (runs,) [s].

        Raises:
            InvalidInput: There is no such cell.
        """
        return self._column(cell, "time")

    def lost(self, cell: str) -> np.ndarray:
        """In which runs of a cell an evader was lost before the horizon, shape (runs,)."""
        return ~self._column(cell, "censored")

    def horizon(self, cell: str) -> float:
        """Horizon of a cell [s]."""
        return float(self._column(cell, "horizon")[0])

    def _column(self, cell: str, name: str) -> np.ndarray:
        return self.rows(cell)[name].to_numpy()


def open_records(study: Study, folder: Path) -> None:
    """Begin a study in a folder, or find that it has been begun there.

    Raises:
        InvalidInput: The folder holds another study, or cannot be written.
    """
    file = folder / "study.json"
    if file.is_file():
        known, ours = _read_settings(folder), _settings(study)
        theirs = {**known, **(known.get("study") or {})}
        flat = {**ours, **ours["study"]}
        differing = [key for key in flat if key != "study" and theirs.get(key) != flat[key]]
        require(
            not differing,
            "out",
            "hold the same study if it holds one",
            f"{folder}, where another {' and '.join(differing)} was chosen",
        )
    else:
        _write(file, (json.dumps(_settings(study), indent=2) + "\n").encode())


def recorded_study(folder: Path) -> Study:
    """The study that was begun in a folder.

    Raises:
        InvalidInput: There is none, or another version of Sightfield began it.
    """
    known = _read_settings(folder)
    ours = version("sightfield")
    require(known.get("version") == ours, "resume", f"be of version {ours}", known.get("version"))
    return study_from_json(known.get("study"))


def write_block(folder: Path, start: int, stop: int, rows: Rows) -> None:
    """Keep the runs from start to stop.

    Raises:
        InvalidInput: The folder cannot be written; a `NoRoom` if its disk is full. What it holds
            already stays.
    """
    buffer = pa.BufferOutputStream()
    pq.write_table(pa.table(rows, schema=SCHEMA), buffer)
    _write(_block_file(folder, start, stop), buffer.getvalue().to_pybytes())


def has_block(study: Study, folder: Path, start: int, stop: int) -> bool:
    """Whether the runs from start to stop are there, and whole."""
    try:
        metadata = pq.read_metadata(_block_file(folder, start, stop))
    except (OSError, pa.ArrowInvalid):
        return False
    return metadata.num_rows == study.games(start, stop)


def finish_records(study: Study, folder: Path, blocks: list[tuple[int, int]]) -> None:
    """Join the blocks into the table."""
    tables = [pq.read_table(_block_file(folder, *block), schema=SCHEMA) for block in blocks]
    table = pa.concat_tables(tables)
    # Blocks come in order of runs, and hold all cells that have each.
    cells = [k for run in range(study.runs) for k in _cells_with(study, run)]
    order = np.argsort(cells, kind="stable")
    buffer = pa.BufferOutputStream()
    pq.write_table(table.take(pa.array(order)).combine_chunks(), buffer)
    _write(folder / "table.parquet", buffer.getvalue().to_pybytes())
    shutil.rmtree(folder / "blocks")


def _cells_with(study: Study, run: int) -> list[int]:
    """Numbers of the cells that have a run."""
    return [k for k, cell in enumerate(study.cells) if run < study.runs_of(cell)]


def is_finished(folder: Path) -> bool:
    """Whether the table is there."""
    return (folder / "table.parquet").is_file()


def load_study(folder: Path) -> StudyResult:
    """Read a finished study.

    Raises:
        InvalidInput: The folder holds none, or one that is not finished.
    """
    study = recorded_study(folder)
    require(is_finished(folder), "study", "be finished", f"one that can be resumed: {folder}")
    table = pq.read_table(folder / "table.parquet", schema=SCHEMA)
    return StudyResult(study, table)


def _settings(study: Study) -> dict[str, Any]:
    return {"version": version("sightfield"), "study": study_to_json(study)}


def _read_settings(folder: Path) -> dict[str, Any]:
    try:
        known = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        known = None
    if not isinstance(known, dict):
        raise InvalidInput(f"`study` must be a folder with a study.json; got {folder}")
    return known


def _block_file(folder: Path, start: int, stop: int) -> Path:
    return folder / "blocks" / f"runs_{start:06d}_{stop:06d}.parquet"


def _write(file: Path, content: bytes) -> None:
    """Write a file that is whole or not there."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, scratch = tempfile.mkstemp(prefix=".unfinished-", dir=file.parent)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(content)
                stream.flush()
                os.fsync(stream.fileno())
            os.chmod(scratch, 0o644)
            os.replace(scratch, file)
        except BaseException:
            Path(scratch).unlink(missing_ok=True)
            raise
    except OSError as error:
        refuse(file.parent, error)

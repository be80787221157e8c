"""Have Numba compile the kernels once, before several processes of tests would compile them each.

Short runs of the commands call nearly all of them. Numba keeps what it makes beside the sources,
with a hash of each, so that nothing is compiled again until its file is changed.
"""

import contextlib
import os
import shlex
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app

GAME = "track thesis_3v4 --no-meshcat --seconds 0.5"
COARSE = "--set pursuers.grid=0.4"
FIELD = "--set field.width=120 --set field.height=90 --set combines.header_width=9"

# What the others look up too, so that no two processes compile it.
FIRST = f"{GAME} --set pursuers.assignment=borda_max --set 'evaders.policies=[adversarial]'"

ROOMS = (
    f"""
    harvest thesis_2 --no-replay {FIELD} --set combines.turning_radius=6
    plan --start 1 1 0 0 --goal 4 4 0 0
    schedule --combines 3 --capacity 9000 --fill-rate 20 --unload-rate 150 --travel-time 60
    """,
    f"""
    {GAME} --set pursuers.model=point --set pursuers.field=table --set bodies_block_sight=true
    {GAME} --set 'evaders.policies=[best_response]' --set pursuers.field=lookahead
    {GAME} --set pursuers.field=guarantee --set pursuers.assignment=guarantee {COARSE}
    {GAME} --set pursuers.field=certified --set pursuers.model=point {COARSE}
    {GAME} --set 'evaders.policies=[optimal_distance, random_walk, optimal, best_response]' {COARSE}
    world map.yaml
    guarantee thesis_3v4 --grid 0.4 --bound lower --sight-range 2
    guarantee thesis_3v4 --grid 0.4 --bound upper
    corner
    reproduce --quick --workers 0 --only table-2.1 --only table-2.2
    social --seconds 1 --seed 2 --no-meshcat --no-replay
    camera track omni_2v2 --seconds 0.5 --no-meshcat
    """,
)


def write_map(folder: Path) -> None:
    """A room of 3 m by 3 m with a block in it, as ROS keeps maps."""
    cells = bytearray(b"\xfe" * 900)
    for row in range(10, 20):
        cells[30 * row + 8 : 30 * row + 17] = bytes(9)
    (folder / "map.pgm").write_bytes(b"P5\n30 30\n255\n" + cells)
    (folder / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )


def run(lines: str) -> None:
    """Run commands in this process, in a folder that goes with them."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        os.environ["SIGHTFIELD_GAMES"] = folder
        write_map(Path(folder))
        for number, line in enumerate(filter(None, map(str.strip, lines.splitlines()))):
            done = CliRunner().invoke(make_app(), [*shlex.split(line), "--out", f"out/{number}"])
            if done.exit_code:
                sys.exit(f"sightfield {line}\n{done.output}\n{done.exception!r}")


if __name__ == "__main__":
    run(FIRST)
    with ProcessPoolExecutor(len(ROOMS), get_context("spawn")) as pool:
        list(pool.map(run, ROOMS))

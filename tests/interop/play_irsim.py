"""Play the station against ir-sim, a simulator of robots that nobody here wrote: `make irsim`.

Six of its robots, in a process and an environment of their own, are driven over topics of ROS 2 by
`station run thesis_3v3 --hardware`; a second run is killed while robots drive. Exit code 1 unless
every pursuer has driven, no body has touched another or a wall, the replay is identical to the bit,
and the robots of the run that was killed stand.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import yaml

from sightfield.diagrams.scenario_files import find_scenario
from sightfield.diagrams.station import scenarios
from sightfield.diagrams.station.laboratory_files import load_station
from sightfield.diagrams.tracking.game import TrackingGame, set_up_game
from sightfield.hardware_io.kinds.dds_node import LOOPBACK

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT / "build" / "peers" / "irsim" / "bin" / "python"
SIGHTFIELD = Path(sys.executable).with_name("sightfield")
DOMAIN, SECONDS = 226, 15.0
ENVIRONMENT = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
SETTINGS = [
    "radio.kind=dds",
    f"radio.options={{domain: {DOMAIN}}}",
    "mocap.source=ros2",
    "mocap.message=PoseStamped",
    "mocap.topic='{body}/pose'",
    f"mocap.domain={DOMAIN}",
    "mocap.bodies=[body1, body2, body3, body4, body5, body6]",
]
# A robot that was not driven far was not driven [m]; one that stands goes no further than this [m].
DRIVEN, STANDS = 0.5, 1e-6
# After its station is gone a robot stands within this [s]: silence, and slowing down.
AT_REST = 0.8


def world_of(game: TrackingGame) -> dict:
    """The laboratory as a world of ir-sim: slow motors, and wheels that slip at random."""
    x_min, y_min, x_max, y_max = map(float, game.world.bounds)
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    robot = {
        "kinematics": {"name": "diff", "noise": True, "alpha": [0.01, 0.0, 0.0, 0.01]},
        "shape": {"name": "circle", "radius": 0.1},
        "vel_min": [-0.6, -4.0],
        "vel_max": [0.6, 4.0],
        "acce": [3.0, 30.0],
    }
    walls = [game.world.boundary, *game.world.obstacles]
    shapes = [{"name": "linestring", "vertices": [*ring, ring[0]]} for ring in map(listed, walls)]
    return {
        "world": {
            "width": x_max - x_min,
            "height": y_max - y_min,
            "offset": [x_min, y_min],
            "step_time": 0.01,
            "collision_mode": "stop",
        },
        "robot": [{**robot, "state": start} for start in starts.tolist()],
        "obstacle": [{"shape": shape, "state": [0, 0, 0]} for shape in shapes],
    }


def listed(ring: np.ndarray) -> list[list[float]]:
    return np.asarray(ring, dtype=float).tolist()


class Plant:
    """ir-sim in its process, and where its robots were; a context manager."""

    def __init__(self, world: Path) -> None:
        peer = Path(__file__).with_name("irsim_plant.py")
        self._process = subprocess.Popen(
            [PYTHON, peer, world, str(DOMAIN)],
            env={**ENVIRONMENT, "PYTHONPATH": str(world.parent)},
            stdout=subprocess.PIPE,
            text=True,
        )
        self.times: list[float] = []
        self.poses: list[np.ndarray] = []
        self.collided = False
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self) -> "Plant":
        self._thread.start()
        if not self.wait(lambda: bool(self.poses), 60.0):
            raise SystemExit("ir-sim says nothing")
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._thread.join()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            # The package prints lines of its own.
            if not line.startswith("{"):
                continue
            told = json.loads(line)
            self.poses.append(np.array(told["poses"]))
            self.times.append(told["time"])
            self.collided |= told["collided"]

    @staticmethod
    def wait(until, patience: float) -> bool:
        end = time.monotonic() + patience
        while not until() and time.monotonic() < end:
            time.sleep(0.01)
        return until()

    def ways(self, since: int = 0) -> np.ndarray:
        """How far each robot has gone [m]."""
        places = np.array(self.poses[since:])[:, :, :2]
        return np.hypot(*np.diff(places, axis=0).transpose(2, 0, 1)).sum(axis=0)

    def moves(self) -> bool:
        """Whether some robot has moved in the last tenth of a second."""
        return bool(self.ways(-6).max() > STANDS)


def station(*words: str | Path) -> list[str]:
    return [str(SIGHTFIELD), "station", *map(str, words)]


def run(out: Path) -> list[str]:
    settings = [word for each in SETTINGS for word in ("--set", each)]
    words = ["run", "thesis_3v3", "--hardware", "--go", "--no-view", "--seconds", str(SECONDS)]
    return station(*words, "--out", out, *settings)


def main() -> int:
    scenario = load_station(find_scenario("thesis_3v3", scenarios), SETTINGS)
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        world, out = Path(folder) / "world.yaml", Path(folder) / "out"
        # The environment of ir-sim has no Sightfield: it takes the types of messages from here.
        (Path(folder) / "sightfield").symlink_to(ROOT)
        world.write_text(yaml.safe_dump(world_of(set_up_game(scenario.tracking))))
        with Plant(world) as plant:
            played = subprocess.run(run(out), env=ENVIRONMENT, check=False)
            ways, pursuers = plant.ways(), scenario.tracking.pursuers.size
            collided = plant.collided
        again = subprocess.run(station("replay", out / "run.log"), env=ENVIRONMENT, check=False)
        summary = json.loads((out / "summary.json").read_text())
        if played.returncode != 0:
            faults.append(f"the run ends with {played.returncode}")
        if ways[:pursuers].min() < DRIVEN:
            faults.append("a pursuer was not driven")
        if collided:
            faults.append("a body touched another, or a wall")
        if again.returncode != 0:
            faults.append("the replay differs")
        with Plant(world) as plant:
            killed = subprocess.Popen(
                run(out.with_name("killed")), env=ENVIRONMENT, stdout=subprocess.DEVNULL
            )
            driven = plant.wait(lambda: plant.ways().max() > 0.5 * DRIVEN, 60.0)
            killed.kill()
            killed.wait()
            began, count = time.monotonic(), len(plant.poses)
            plant.wait(lambda: len(plant.poses) > count + 10 and not plant.moves(), 5.0)
            rest = time.monotonic() - began - 0.1
        if not driven or rest > AT_REST:
            faults.append("robots of a station that was killed drive on")
    print(
        f"ir-sim: {summary['tracking_time']:.1f} s of tracking, robots drove "
        f"{', '.join(f'{way:.2f}' for way in ways)} m; after kill -9 they stand in {rest:.2f} s"
    )
    for fault in faults:
        print(f"ir-sim: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

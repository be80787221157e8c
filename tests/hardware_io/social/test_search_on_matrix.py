"""The whole search, from pixels to the evader, through a real homeserver."""

import threading
import time
from pathlib import Path

import numpy as np

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.social import scenarios
from sightfield.diagrams.social.networks import NetworkChoice, open_network
from sightfield.diagrams.social.report import summarise_search
from sightfield.diagrams.social.run import run_social_search
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.social.social_game import set_up_social_game
from sightfield.hardware_io.social.accounts import save_directory

# Three agents that hardly move and see the evader, which rests, and landmarks behind it. The first
# never accepts and says so, the others come and go.
SETTINGS = (
    "seconds=28",
    "seed=3",
    "agents.friending=[0.0, 0.9, 0.9]",
    "agents.unfriending=[0.0, 0.25, 0.25]",
    "agents.rejection=[1.0, 0.0, 0.0]",
    "agents.speed=0.001",
    "agents.poses=[[1.47, 1.73, -2.08], [1.02, 0.48, 1.57], [0.39, 1.42, -0.54]]",
    "evader={policy: rest, pose: [1.1, 1.1, 0.4]}",
    "pursuer.pose=[0.25, 0.6, 1.57]",
)


def test_the_evader_is_found_in_albums_on_a_server_that_is_restarted_meanwhile(maze, tmp_path):
    accounts = tmp_path / "accounts.yaml"
    save_directory(maze.directory(3), accounts)
    path: Path = find_scenario("thesis_maze", scenarios)
    game = set_up_social_game(load_scenario(SocialScenario, path, SETTINGS))
    choice = NetworkChoice(kind="matrix", accounts=accounts, homeserver=maze.synapse.url)
    restarts = []

    def restart() -> None:
        with maze.synapse.down():
            time.sleep(0.5)
        restarts.append(time.monotonic())

    restarting = threading.Thread(target=restart)

    def watch(seconds: float) -> None:
        if seconds > 8.0 and restarting.ident is None:
            restarting.start()
        if seconds > 12.0:
            # However long the server takes, half of the run is left.
            restarting.join()

    with open_network(game, choice) as network:
        run = run_social_search(game, network, realtime_rate=1.0, progress=watch)
    numbers = summarise_search(run, "thesis_maze", "matrix")
    assert len(restarts) == 1
    # The first agent was asked again and again, and never became a friend.
    connected = run.log["connected"]
    assert not connected[:, 0].any()
    assert numbers["requests_sent"] > 3
    assert connected[:, 1:].any(axis=0).all()
    # Somebody unfriended the pursuer.
    assert (np.diff(connected.astype(int), axis=0) < 0).any()
    # Pictures were read before and after the restart, each once, and no stranger's.
    read = [each.picture for each in run.readings]
    assert len({each.id for each in read}) == len(read) == numbers["pictures_scanned"]
    assert {each.agent for each in read} <= {1, 2}
    assert min(each.time for each in read) < 8.0
    assert max(each.time for each in read) > 12.0
    assert numbers["location_error"]["median"] < 0.02
    assert numbers["collisions"] == 0
    # The pursuer came to where it stands off.
    assert np.hypot(*(run.log["pose"][-1, 0, :2] - [1.1, 1.1])) < 0.6

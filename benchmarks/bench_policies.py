"""What each way to pursue and to escape is worth, in paired games on the seeds of the studies.

As many games as given below, or as GAMES says: `GAMES=20 make bench ARGS="-k policies"`.
"""

import math
import os
import time
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import EventStatus

from sightfield.diagrams.studies.engine import run_study
from sightfield.diagrams.studies.opponents import Match, cell_name, match_cell
from sightfield.diagrams.studies.study import Cell, Study
from sightfield.diagrams.studies.team_studies import thesis_base
from sightfield.diagrams.tracking.game import TrackingGame, set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.solved_game import solved_game
from sightfield.systems.numerics.statistics import paired_difference, restricted_mean
from sightfield.systems.numerics.tracking.best_response.rollouts import Rollout
from sightfield.systems.tracking import BestResponseEvaders
from sightfield.systems.tracking.best_response_evaders import ALONE, IN_TEAMS, Foresight

pytestmark = pytest.mark.benchmarks

# Games a row: one against one by opponent, teams, settings of rollouts by team size, periods,
# pursuers that are fewer than their evaders; games in which changes are counted.
ONE_ON_ONE = {"adversarial": 1000, "best_response": 300}
TEAMS, ROLLOUTS, PERIODS, REASSIGNED = 100, 200, 40, 20

# Field, rule and hold of the assignment; the first is what the others are compared with.
HOLDS = {
    "none": ("margin", "hungarian", "none"),
    "until_lost": ("margin", "hungarian", "until_lost"),
    "max_none": ("margin", "hungarian_max", "none"),
    "max_until_lost": ("margin", "hungarian_max", "until_lost"),
    "guarantee": ("guarantee", "guarantee", "certificate"),
}

# The thesis's pursuers, the field of this project held steadily, and play by the solved game.
SOLVED = {
    "thesis": ("pursuers.field=table",),
    "margin": (
        "pursuers.field=margin",
        "pursuers.assignment=hungarian_max",
        "pursuers.hold=until_lost",
    ),
    "guarantee": (
        "pursuers.field=guarantee",
        "pursuers.assignment=guarantee",
        "pursuers.hold=certificate",
    ),
}

# Which starts can be won is judged on the grid that is played by, and on a finer one [m].
WINNABLE_BY = (0.1, 0.05)

# Plans that an evader tries beside the straight runs, about: the corners that it sees, the game's
# play, what it does so far.
OTHER_PLANS = 5

# What the pursuers do whose opponents are compared: the thesis's alone, the best as a team.
PURSUERS = {
    "1v1": ("pursuers.count=1", "evaders.count=1"),
    "3v3": (
        "pursuers.count=3",
        "evaders.count=3",
        "pursuers.field=margin",
        "pursuers.assignment=hungarian_max",
        "pursuers.hold=until_lost",
    ),
}


def games(usual: int) -> int:
    """How many games are played."""
    return int(os.environ.get("GAMES", usual))


def difference(first: np.ndarray, second: np.ndarray) -> str:
    """The mean of first - second with its interval."""
    found = paired_difference(first, second)
    return f"{found.mean:+.1f} [{found.low:+.1f}, {found.high:+.1f}] s"


def ratio(first: np.ndarray, second: np.ndarray) -> str:
    """The ratio of the means of first and second with its interval, by bootstrap of the pairs."""
    drawn = np.random.default_rng(0).integers(0, len(first), (10_000, len(first)))
    low, high = np.quantile(first[drawn].mean(axis=1) / second[drawn].mean(axis=1), (0.025, 0.975))
    return f"{first.mean() / second.mean():.2f} [{low:.2f}, {high:.2f}]"


@pytest.mark.parametrize("opponent", ONE_ON_ONE)
@pytest.mark.parametrize("field", ["margin", "lookahead"])
def test_fields_and_lookahead_one_against_one(field, opponent, tmp_path):
    runs = {opponent: games(ONE_ON_ONE[opponent])}
    fields = ("table", field)
    cells = [
        match_cell(Match(1, 1, each, opponent), (f"pursuers.field={each}",), runs)
        for each in fields
    ]
    study = Study(name="fields", base=thesis_base(), cells=tuple(cells), runs=runs[opponent])
    result = run_study(study, tmp_path / "fields", workers=2)
    print(f"\n1 against 1, {study.runs} games against {opponent}")
    table = result.times(cell_name(1, 1, "table", opponent))
    for each in fields:
        name = cell_name(1, 1, each, opponent)
        times = result.times(name)
        mean = restricted_mean(times, result.lost(name), result.horizon(name))
        print(
            f"{each}: {mean.value:.1f} [{mean.low:.1f}, {mean.high:.1f}] s; less table "
            f"{difference(times, table)}"
        )


@pytest.mark.parametrize("size", ["2v2", "3v3", "3v4", "4v4"])
def test_holding_an_assignment(size, tmp_path):
    pursuers, evaders = map(int, size.split("v"))
    runs = {"best_response": games(TEAMS)}
    cells = [
        match_cell(
            Match(pursuers, evaders, name, "best_response"),
            (f"pursuers.field={field}", f"pursuers.assignment={rule}", f"pursuers.hold={hold}"),
            runs,
        )
        for name, (field, rule, hold) in HOLDS.items()
    ]
    study = Study(name="holds", base=thesis_base(), cells=tuple(cells), runs=runs["best_response"])
    result = run_study(study, tmp_path / "holds", workers=2)
    times = {name: result.times(cell.name) for name, cell in zip(HOLDS, cells, strict=True)}
    print(f"\n{size}, {study.runs} games against best_response")
    for name, (field, rule, hold) in HOLDS.items():
        print(
            f"{field}, {rule}, {hold}: {times[name].mean():.1f} s; over hungarian, none "
            f"{ratio(times[name], times['none'])}, {difference(times[name], times['none'])}"
        )
    print(
        "hungarian_max, until_lost, over hungarian_max, none: "
        f"{ratio(times['max_until_lost'], times['max_none'])}"
    )


@pytest.mark.parametrize("size", ["1v1", "2v2", "3v3", "4v4", "4v3", "4v2", "1v2", "2v3", "3v4"])
def test_playing_by_the_solved_game(size, tmp_path):
    pursuers, evaders = map(int, size.split("v"))
    runs = dict.fromkeys(("adversarial", "best_response", "optimal_distance"), games(TEAMS))
    cells = [
        match_cell(Match(pursuers, evaders, name, opponent), settings, runs)
        for opponent in runs
        for name, settings in SOLVED.items()
    ]
    study = Study(
        name="solved",
        base=thesis_base(seconds=120.0),
        cells=tuple(cells),
        runs=games(TEAMS),
        # As in no other study.
        seed=1,
        starts_per_arena=10,
    )
    result = run_study(study, tmp_path / "solved", workers=1)
    worst = dict.fromkeys(SOLVED, np.inf)
    print(f"\n{size}, {study.runs} games against each, at most 120 s")
    for opponent in runs:
        found = {}
        for name in SOLVED:
            cell = cell_name(pursuers, evaders, name, opponent)
            found[name] = result.times(cell)
            mean = restricted_mean(found[name], result.lost(cell), result.horizon(cell))
            worst[name] = min(worst[name], mean.value)
            print(f"{name} against {opponent}: {mean.value:.1f} [{mean.low:.1f}, {mean.high:.1f}]")
        print(f"guarantee over thesis: {ratio(found['guarantee'], found['thesis'])}")
    print(
        f"worst opponents: {worst['guarantee']:.1f} over {worst['thesis']:.1f} s, "
        f"{worst['guarantee'] / worst['thesis']:.2f}; margin {worst['margin']:.1f} s"
    )
    if (pursuers, evaders) != (1, 1):
        return
    for grid in WINNABLE_BY:
        winnable = np.array([is_winnable(study, run, grid) for run in range(study.runs)])
        for name in SOLVED:
            kept = np.ones(study.runs, dtype=bool)
            for opponent in runs:
                kept &= result.times(cell_name(1, 1, name, opponent)) >= study.base.seconds
            share = f"{kept[winnable].mean():.1%} of {winnable.sum()} starts"
            print(f"{name} keeps {share} that can be kept by the game on a grid of {grid} m")


def is_winnable(study: Study, run: int, grid: float) -> bool:
    """Whether one pursuer keeps its evader for ever from a run's start, by the middle bound."""
    scenario = study.scenario(study.cells[0], run)
    game = set_up_game(replace(scenario, pursuers=replace(scenario.pursuers, grid=grid)))
    start = game.pursuer_starts[0, :2], game.evader_starts[0, :2]
    return math.isinf(solved_game(game).time(*start))


@pytest.mark.parametrize("size", ["2v2", "3v3", "4v4", "4v3", "4v2", "3v4"])
def test_reassignments(size):
    """How often the team changes who watches whom, up to the loss: of an evader to another pursuer,
    where pursuers are fewer."""
    pursuers, evaders = map(int, size.split("v"))
    runs = {"optimal_distance": games(REASSIGNED)}
    match = Match(pursuers, evaders, "guarantee", "optimal_distance")
    cell = match_cell(match, SOLVED["guarantee"], runs)
    study = Study(
        name="reassigned",
        base=thesis_base(seconds=120.0),
        cells=(cell,),
        runs=games(REASSIGNED),
        seed=1,
        starts_per_arena=2,
    )
    changes, seconds = 0, 0.0
    for run in range(study.runs):
        game = set_up_game(study.scenario(cell, run))
        found = changes_in(game)
        changes, seconds = changes + found[0], seconds + found[1]
    print(
        f"\n{size}, {study.runs} games against optimal_distance: {changes} changes in "
        f"{seconds:.0f} s, {60.0 * changes / seconds:.2f} a minute, {changes / study.runs:.2f} a "
        "game"
    )


def changes_in(game: TrackingGame) -> tuple[int, float]:
    """How often who watches whom changes up to the first loss, and when that is [s]."""
    diagram = MakeTracking(game)
    simulator = Simulator(diagram)
    loss, context = diagram.GetOutputPort("loss"), simulator.get_context()
    port, owner = diagram.GetOutputPort("assignment"), diagram
    for system in diagram.GetSystems():
        if system.HasOutputPort("responsible"):
            port, owner = system.GetOutputPort("responsible"), system
    times, before = [], []

    def watch(root):
        now = port.Eval(owner.GetMyContextFromRoot(root)).tolist()
        if before and now != before[-1]:
            times.append(root.get_time())
        before[:] = [now]
        return EventStatus.DidNothing()

    simulator.set_monitor(watch)
    horizon, lost_at = game.scenario.seconds, math.inf
    while context.get_time() < horizon and lost_at > horizon:
        simulator.AdvanceTo(min(context.get_time() + 1.0, horizon))
        lost_at = float(np.asarray(loss.Eval(context))[0])
    end = min(lost_at, horizon)
    return sum(time <= end for time in times), end


def evaders_with(game: TrackingGame, foresight: Foresight):
    """`best_response` evaders of a game, with settings of one's own."""
    scenario = game.scenario
    return BestResponseEvaders(
        game.world,
        game.pursuer_regions,
        game.evader_regions,
        pursuers=scenario.pursuers.size,
        evaders=scenario.evaders.size,
        pursuer_speed=scenario.pursuers.top_speed,
        evader_speed=scenario.evaders.top_speed,
        pursuit=scenario.pursuers.field,
        risk_vectors=scenario.pursuers.risk_vectors,
        assignment=scenario.pursuers.assignment,
        hold=scenario.pursuers.switch,
        foresight=foresight,
    )


def tracking_time(game: TrackingGame, foresight: Foresight) -> float:
    """How long the evaders are kept, up to the horizon [s]."""
    diagram = MakeTracking(game, evasion=evaders_with(game, foresight))
    simulator, horizon = Simulator(diagram), game.scenario.seconds
    loss, context = diagram.GetOutputPort("loss"), simulator.get_context()
    while context.get_time() < horizon:
        simulator.AdvanceTo(min(context.get_time() + 1.0, horizon))
        lost_at = np.asarray(loss.Eval(context))[0]
        if lost_at <= horizon:
            return float(lost_at)
    return horizon


def steps_played(foresight: Foresight) -> float:
    """Steps that an evader plays ahead for each second of the game, at most about.

    Without those beyond, which are for the few games that are long.
    """
    rollout = foresight.rollout
    plans = rollout.headings + OTHER_PLANS
    return plans * rollout.horizon / rollout.step / foresight.decision_period


def random_settings(number: int, default: Foresight) -> list[Foresight]:
    """Settings that play as many steps as the default.

    The horizon is of 4 to 20 s, the step of 0.1 to 0.5 s, headings are 8 to 32; the period is what
    is left to choose.
    """
    rng, found = np.random.default_rng(0), []
    budget = steps_played(default)
    for _ in range(number):
        rollout = Rollout(
            round(rng.uniform(4.0, 20.0), 1),
            round(rng.uniform(0.1, 0.5), 2),
            int(rng.integers(8, 33)),
        )
        period = round(steps_played(Foresight(rollout, 1.0)) / budget, 2)
        found.append(Foresight(rollout, period))
    return found


@pytest.mark.parametrize("size", PURSUERS)
def test_settings_of_rollouts(size):
    number = games(ROLLOUTS)
    cell = Cell(name=size, settings=PURSUERS[size])
    study = Study(name="rollouts", base=thesis_base(), cells=(cell,), runs=number)
    default = ALONE if size == "1v1" else IN_TEAMS
    settings = [default, *random_settings(5, default)]
    times, costs = np.empty((len(settings), number)), np.zeros(len(settings))
    for run in range(number):
        game = set_up_game(study.scenario(cell, run))
        for k, chosen in enumerate(settings):
            began = time.process_time()
            times[k, run] = tracking_time(game, chosen)
            costs[k] += time.process_time() - began
    print(f"\n{number} games, {', '.join(cell.settings)}")
    for k, foresight in enumerate(settings):
        rollout, period = foresight.rollout, foresight.decision_period
        print(
            f"{rollout.horizon:g} s in steps of {rollout.step:g} s, {rollout.headings} headings, "
            f"every {period:.2f} s, {steps_played(foresight):.0f} steps: "
            f"{times[k].mean():.1f} s, over the default {ratio(times[k], times[0])}, "
            f"{difference(times[k], times[0])}; {costs[k] / times[k].sum() * 1e3:.1f} ms of CPU "
            "for a second of play"
        )


def test_half_the_period(tmp_path):
    number = games(PERIODS)
    times = {}
    for period in (0.05, 0.025):
        cell = Cell(
            name="games",
            settings=(
                "pursuers.count=2",
                "evaders.count=2",
                "pursuers.field=margin",
                "pursuers.hold=until_lost",
                f"period={period}",
            ),
        )
        study = Study(name="periods", base=thesis_base(), cells=(cell,), runs=number)
        times[period] = run_study(study, tmp_path / f"{period}", workers=1).times("games")
    moved = times[0.025] - times[0.05]
    print(
        f"\n2 against 2, {number} games against adversarial: half the period moves "
        f"{(moved > 1).sum()} games by more than 1 s later, {(moved < -1).sum()} earlier, the most "
        f"by {np.abs(moved).max():.1f} s; the mean of {times[0.05].mean():.1f} s by "
        f"{difference(times[0.025], times[0.05])}"
    )

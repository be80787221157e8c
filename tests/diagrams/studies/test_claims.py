"""Claims are judged as the made-up times want it."""

import numpy as np
import pytest

from sightfield.diagrams.studies.claims import (
    FAILS,
    HOLDS,
    OPEN,
    compare,
    joint_verdict,
    judge_everywhere,
    variants,
    varied,
)
from sightfield.diagrams.studies.opponents import opponent_of, runs_by_opponent
from sightfield.diagrams.studies.team_studies import assignment_study, tracking_study
from sightfield.diagrams.studies.thesis_claims import (
    LEAST,
    TEAMS,
    VECTORS,
    judge_allocations,
    judge_teams,
)
from sightfield.systems.numerics.errors import InvalidInput

RUNS = 60
ALONE = ("adversarial",)
TEAM_STUDY = tracking_study(runs=RUNS, vectors=tuple(VECTORS), opponents=ALONE)
BOTH = tracking_study(runs=RUNS, vectors=tuple(VECTORS), opponent_runs={"best_response": 30})
ALLOCATION_STUDY = assignment_study(runs=RUNS, rules=TEAMS)


def as_claimed(noise, fall=4.0, rise=4.0, level=LEAST):
    """Times as the thesis has them: least at 1 against 4, and vectors apart as agents grow."""

    def time_of(cell, rng):
        n, m = cell.value("pursuers.count"), cell.value("evaders.count")
        (vector,) = cell.value("pursuers.risk_vectors")
        apart = 0.3 * (n + m) * (list(VECTORS).index(vector) - 1)
        base = level + 1.5 + rise * (n - 1) + fall * (4 - m) + apart
        return base + noise * rng.normal(size=RUNS)

    return time_of


def verdicts(found):
    return {each.claim: each.verdict for each in found}


def test_everything_holds_where_times_are_as_claimed(made_up):
    found = judge_teams(made_up(TEAM_STUDY, as_claimed(noise=1.0)))
    assert set(verdicts(found).values()) == {HOLDS}
    figures = {each.strongest.figure for each in found}
    assert figures == {"2.16", "2.17", "2.18", "2.16 to 2.18"}


def against_two(shift):
    """Times as claimed against one opponent, those against the other shorter and the wrong way."""

    def time_of(cell, rng):
        times = as_claimed(noise=1.0)(cell, rng)
        if cell.value("evaders.policies") == ["best_response"]:
            # Mirrored about 74.62 s: what rose falls.
            times = 2 * LEAST - times - shift
        return times

    return time_of


def test_a_claim_holds_only_if_it_does_against_the_strongest_opponent(made_up):
    found = judge_teams(made_up(BOTH, against_two(shift=40.0)))
    for each in found:
        weak, strong = each.against
        assert (weak.opponent, strong.opponent) == ("adversarial", "best_response")
        assert weak.verdict == HOLDS
        assert strong.level < weak.level
        assert each.strongest is strong
        assert each.verdict == strong.verdict
    judged = verdicts(found)
    assert {judged[f"t{k} falls with evaders"] for k in (1, 2, 3)} == {FAILS}
    falls = next(each for each in found if each.claim == "t1 falls with evaders")
    assert falls.said == "does not hold, against best_response, the strongest of 2"
    assert falls.evidence.startswith("Does not hold, against best_response, the strongest of 2 (m")
    assert " Holds, against adversarial (mean " in falls.evidence


def test_a_claim_that_fails_only_against_a_weaker_opponent_holds(made_up):
    found = judge_teams(made_up(BOTH, against_two(shift=-40.0)))
    assert verdicts(found)["t1 falls with evaders"] == HOLDS
    (falls,) = [each for each in found if each.claim == "t1 falls with evaders"]
    assert [each.verdict for each in falls.against] == [HOLDS, FAILS]
    assert falls.strongest.opponent == "adversarial"


def test_a_claim_with_one_opponent_says_so(made_up):
    found = judge_teams(made_up(TEAM_STUDY, as_claimed(noise=1.0)))
    assert {each.said for each in found} == {"holds, against adversarial alone"}
    assert all(each.evidence.startswith("Holds, against adversarial alone") for each in found)


def test_opponents_are_compared_on_the_runs_that_they_share(made_up):
    """The runs that the weaker one alone has would make it the stronger."""

    def time_of(cell, rng):
        times = as_claimed(noise=0.1)(cell, rng)
        times[30:] -= 60.0
        return times - (1.0 if cell.value("evaders.policies") == ["best_response"] else 0.0)

    found = judge_teams(made_up(BOTH, time_of))
    assert {each.strongest.opponent for each in found} == {"best_response"}


def test_nothing_holds_where_times_are_the_other_way_round(made_up):
    def backwards(cell, rng):
        n, m = cell.value("pursuers.count"), cell.value("evaders.count")
        (vector,) = cell.value("pursuers.risk_vectors")
        apart = 0.3 * (9 - n - m) * (list(VECTORS).index(vector) - 1)
        return 20.0 + 2.0 * m - 2.0 * n + apart + rng.normal(size=RUNS)

    found = verdicts(judge_teams(made_up(TEAM_STUDY, backwards)))
    assert set(found.values()) == {FAILS}


def test_noise_leaves_it_open(made_up):
    def noise(cell, rng):
        # Its own for each cell.
        rng = np.random.default_rng(sum(map(ord, cell.name)) + 7 * len(cell.name))
        return LEAST + 60 * rng.normal(size=RUNS)

    found = verdicts(judge_teams(made_up(TEAM_STUDY, noise)))
    assert found["least at 1 against 4"] == OPEN
    assert {found[f"t{k} falls with evaders"] for k in (1, 2, 3)} == {OPEN}


def test_a_shorter_horizon_cuts_the_times_off(made_up):
    result = made_up(TEAM_STUDY, as_claimed(noise=1.0))
    short = judge_everywhere(judge_teams, {"long": result}, horizons=(30.0,))
    assert verdicts(short["long"])["t1 above 50"] == HOLDS
    # Nobody is lost within 30 s: all differences are those of nothing, and means are unknown.
    assert verdicts(short["30 s"])["t1 above 50"] == OPEN
    assert verdicts(short["30 s"])["74.62 there"] == OPEN
    assert verdicts(short["30 s"])["t1 falls with evaders"] == OPEN
    with pytest.raises(InvalidInput, match="`horizon` must be at most the study's"):
        judge_teams(result, horizon=130.0)


def test_horizons_no_shorter_than_the_games_are_left_out(made_up):
    result = made_up(TEAM_STUDY, as_claimed(noise=1.0))
    judged = judge_everywhere(judge_teams, {"long": result}, horizons=(30.0, 120.0, 130.0))
    assert list(judged) == ["long", "30 s"]


def test_allocations_as_claimed(made_up):
    def time_of(cell, rng):
        m, rule = cell.value("evaders.count"), cell.value("pursuers.assignment")
        if m == 1:
            return np.full(RUNS, 500.0)
        gain = (10.0 if m <= 3 else 3.0) if rule.startswith("borda") else 0.0
        return 40.0 + gain + rng.normal(size=RUNS)

    found = verdicts(judge_allocations(made_up(ALLOCATION_STUDY, time_of)))
    # 240 runs without a loss against each opponent are not yet nearly all of them.
    assert found.pop("one evader is never lost") == OPEN
    assert set(found.values()) == {HOLDS}


def test_one_loss_is_a_loss(made_up):
    def time_of(cell, rng):
        times = np.full(RUNS, 500.0)
        times[0] = 3.0 if cell.name == "3v1-borda_min-best_response" else 500.0
        return times

    found = verdicts(judge_allocations(made_up(ALLOCATION_STUDY, time_of)))
    # The opponent to which somebody was lost is the stronger.
    assert found["one evader is never lost"] == FAILS
    assert found["borda_min is better"] == OPEN


def test_one_sure_test_against_a_claim_outweighs_all_others():
    up, down = np.linspace(4, 6, 50), np.linspace(-6, -4, 50)
    assert joint_verdict([compare("a", up, 0.0)] * 9)[0] == HOLDS
    assert joint_verdict([*[compare("a", up, 0.0)] * 9, compare("b", down, 0.0)])[0] == FAILS
    unsure = compare("c", np.linspace(-5, 5, 50), 0.0)
    verdict, said = joint_verdict([compare("a", up, 0.0), unsure])
    assert verdict == OPEN
    assert said.startswith("1 of 2 tests in favour, 0 against, after Holm; least: c ")


def test_variants_play_what_they_say(tmp_path):
    found = {each.name: each for each in variants()}
    assert found["evaders that wander"].opponents == ("random_walk",)
    wandering = varied(
        tracking_study,
        found["evaders that wander"],
        {"best_response": 1, "random_walk": 2},
        sizes=(1,),
    )
    assert {opponent_of(wandering, cell) for cell in wandering.cells} == {"random_walk"}
    assert {wandering.runs_of(cell) for cell in wandering.cells} == {2}
    numbers = {"adversarial": 2, "best_response": 1}
    few = varied(tracking_study, found["2 obstacles"], numbers, sizes=(1,))
    assert runs_by_opponent(few) == numbers
    assert found["2 obstacles"].arena.obstacles == 2
    assert found["robots of the testbed"].base.pursuers.model == "differential_drive"
    file = tmp_path / "hall.wkt"
    file.write_text("POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0), (1 1, 2 1, 2 2, 1 2, 1 1))")
    own = variants(file)[-1]
    assert own.name == "hall"
    study = varied(tracking_study, own, numbers, sizes=(1, 2), vectors=tuple(VECTORS))
    assert study.arena is None
    assert study.scenario(study.cells[0], 1).world.load().free_area == pytest.approx(15.0)

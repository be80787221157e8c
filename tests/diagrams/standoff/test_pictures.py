"""Pictures of the stand-off loop show what they say."""

import numpy as np
import pytest

from sightfield.diagrams.standoff.analysis import analyse_standoff
from sightfield.diagrams.standoff.pictures.linear_pictures import draw_bode, draw_root_locus
from sightfield.diagrams.standoff.pictures.phase_picture import draw_phase_portrait
from sightfield.diagrams.standoff.pictures.replay import write_standoff_replay
from sightfield.diagrams.standoff.pictures.response_picture import draw_responses
from sightfield.diagrams.standoff.run import run_standoff
from sightfield.diagrams.standoff.scenario import StandoffScenario
from sightfield.systems.numerics.standoff.equilibria import wanted_equilibrium
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop


def curves(axes):
    """Lines of axes by their labels: x and y, shape (n, 2)."""
    return {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.get_lines()}


def test_all_four_responses_begin_at_the_start_and_end_beside_the_reference():
    found = curves(draw_responses(StandoffLoop(), 0.1, duration=30.0).axes[0])
    rest = wanted_equilibrium(StandoffLoop()).y
    for name in (*CONTROLLERS, "PI, integral empty", "PID, integral empty"):
        assert found[name][0].tolist() == [0.0, 0.1]
        assert found[name][-1] == pytest.approx([30.0, rest], abs=1e-5)
    # From rest the loops of second order start level.
    first, second = found["PI"][:2]
    assert abs(second[1] - first[1]) < 0.1 * (second[0] - first[0])


def test_controllers_that_the_gains_do_not_suit_are_left_out():
    found = curves(draw_responses(StandoffLoop(controller="P", ki=0.0), 0.1).axes[0])
    assert {"P", "PD"} <= found.keys()
    assert not {"PI", "PID"} & found.keys()


def test_the_bias_is_where_the_estimate_crosses_the_reference():
    found = curves(draw_responses(StandoffLoop(), 0.1).axes[1])
    estimate = found["estimate y - e(y)"]
    crossing = estimate[np.flatnonzero(np.diff(np.sign(estimate[:, 1] - 0.2))), 0]
    assert crossing == pytest.approx([0.221, 1.436], abs=0.01)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_phase_portrait_marks_equilibria_and_singularity(controller):
    found = analyse_standoff(StandoffLoop(controller=controller))
    (axes,) = draw_phase_portrait(found).axes
    dots = [line for line in axes.get_lines() if line.get_marker() == "o"]
    places = [float(np.asarray(dot.get_xdata())[0]) for dot in dots]
    assert places == [each.y for each in found.equilibria]
    full = [dot.get_markerfacecolor() == "black" for dot in dots]
    assert full == [True, False]
    assert ("singularity" in curves(axes)) == bool(found.singularities)
    assert ("border (separatrix)" in curves(axes)) == found.loop.integrates


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_locus_holds_the_poles_and_the_bode_diagram_the_crossover(controller):
    found = analyse_standoff(StandoffLoop(controller=controller, kd=0.5))
    ideal = curves(draw_root_locus(found).axes[0])["gains as given"]
    expected = sorted([pole.real, pole.imag] for pole in found.wanted.poles)
    np.testing.assert_allclose(sorted(ideal.tolist()), expected, atol=1e-6)
    magnitude, phase = draw_bode(found).axes
    (words,) = [name for name in curves(magnitude) if name.startswith("ideal")]
    assert f"{1000 * found.margin.delay:.1f} ms" in words
    curve = curves(magnitude)[words]
    at_one = np.exp(np.interp(0, -np.log(curve[:, 1]), np.log(curve[:, 0])))
    assert at_one == pytest.approx(found.margin.frequency, rel=0.01)
    first = np.asarray(phase.get_lines()[0].get_ydata())[0]
    assert first == pytest.approx(-180.0 if found.loop.integrates else -90.0, abs=2)


@pytest.mark.browser
def test_the_replay_plays_without_complaints(tmp_path, new_page):
    scenario = StandoffScenario(loop=StandoffLoop(), evader_speed=0.2)
    run = run_standoff(scenario, 3.0)
    file = write_standoff_replay(tmp_path / "replay.html", run, "PID")
    watched = new_page()
    watched.page.goto(file.as_uri())
    watched.page.wait_for_function("typeof viewer !== 'undefined'")
    assert watched.page.title() == "Sightfield: stand-off"

    def place(name):
        path = f"['standoff', '{name}', 'body']"
        return watched.page.evaluate(f"viewer.scene_tree.find({path}).object.position.x")

    watched.page.evaluate("viewer.animator.seek(2.0)")
    at = round(2.0 / scenario.sampled.period)
    assert place("evader") == pytest.approx(run.evader[at], abs=0.02)
    assert place("pursuer") == pytest.approx(run.pursuer[at], abs=0.02)
    assert watched.complaints == []

"""Pictures of the stand-off loop show what they say."""

import numpy as np
import pytest
from matplotlib.contour import QuadContourSet

from sightfield.diagrams.standoff.analysis import analyse_standoff
from sightfield.diagrams.standoff.make_standoff import StandoffScenario, run_standoff
from sightfield.diagrams.standoff.pictures import (
    draw_bode,
    draw_nyquist,
    draw_phase_portrait,
    draw_responses,
    draw_root_locus,
    draw_sampled_region,
)
from sightfield.diagrams.standoff.simulation import write_standoff_replay
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop, wanted_equilibrium
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid


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
    low, high = axes.get_ylim()
    assert low == -high
    if found.loop.integrates:
        # Of the border, what stands between the sides is shown whole, with a margin.
        border = curves(axes)["border (separatrix)"]
        left, right = axes.get_xlim()
        beside = (border[:, 0] > left) & (border[:, 0] < right)
        assert high == pytest.approx(1.15 * np.abs(border[beside, 1]).max())


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


def test_the_locus_shows_what_decides_and_not_the_filter_far_out():
    _, filtered = draw_root_locus(analyse_standoff(StandoffLoop())).axes
    left, right = filtered.get_xlim()
    # The filter's pole is at -140, the zeros are at -0.5 and -7.9, the slow poles between them.
    assert -20 < left < -8
    assert 0 < right < 10


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_nyquists_diagram_passes_through_its_margins(controller):
    found = analyse_standoff(StandoffLoop(controller=controller, kd=0.5), delay_samples=3)
    plane, over = draw_nyquist(found).axes
    shown = curves(plane)
    curve = shown["L(exp(jwh)), w > 0"]
    for words, point in shown.items():
        if "margin" in words:
            assert np.abs(curve - point[0]).sum(axis=1).min() < 0.05
    assert f"{found.sampled_margins.peak_sensitivity:.3f}" in over.get_title()
    (peak,) = [line for line in over.get_lines() if line.get_marker() == "o"]
    assert np.asarray(peak.get_ydata()) == pytest.approx(found.sampled_margins.peak_sensitivity)


@pytest.mark.browser
@pytest.mark.parametrize("size", [(1280, 720), (400, 800)], ids=str)
def test_the_replay_plays_without_complaints_and_keeps_both_in_view(tmp_path, new_page, size):
    scenario = StandoffScenario(loop=StandoffLoop(), evader_speed=0.2)
    run = run_standoff(scenario, 8.0)
    file = write_standoff_replay(tmp_path / "replay.html", run, "PID")
    watched = new_page()
    watched.page.set_viewport_size({"width": size[0], "height": size[1]})
    watched.page.goto(file.as_uri())
    watched.page.wait_for_function("typeof viewer !== 'undefined'")
    assert watched.page.title() == "Sightfield: stand-off"

    def place(name, time):
        """Along the line [m], and in the window, from -1 to 1."""
        node = f"viewer.scene_tree.find(['standoff', '{name}', 'body']).object"
        return watched.page.evaluate(
            f"(() => {{ viewer.animator.seek({time}); const node = {node};"
            "node.updateWorldMatrix(true, false);"
            "const at = node.position.clone().setFromMatrixPosition(node.matrixWorld);"
            "viewer.camera.updateMatrixWorld(); const seen = at.project(viewer.camera);"
            "return [node.position.x, seen.x]; })()"
        )

    for time in (0.0, 2.0, 8.0):
        at = round(time / scenario.sampled.period)
        (evader, evader_seen), (pursuer, pursuer_seen) = (
            place("evader", time),
            place("pursuer", time),
        )
        assert evader - pursuer == pytest.approx(run.distance[at], abs=0.02)
        assert abs(evader_seen) < 0.95
        assert abs(pursuer_seen) < 0.95
    # The distance in digits: the last three of 0.221, after the point.
    shown = watched.page.evaluate(
        "[2, 1, 0].map(place => [0,1,2,3,4,5,6,7,8,9].filter(digit => viewer.scene_tree.find("
        "['standoff', 'numbers', '3', String(place), String(digit)]).object.visible))"
    )
    assert shown == [[2], [2], [0]] or shown == [[2], [2], [1]]
    assert watched.complaints == []


@pytest.mark.parametrize("controller", ["PI", "PID"])
def test_the_region_with_clock_and_delay_is_painted_where_motions_come_to_rest(controller):
    loop = StandoffLoop(controller=controller, kd=0.2)
    found = analyse_standoff(loop, SampledPid(period=0.05), delay_samples=1)
    (axes,) = draw_sampled_region(found).axes
    (painted,) = [each for each in axes.collections if isinstance(each, QuadContourSet)]
    (region,) = painted.get_paths()
    # At the wanted equilibrium, and not beyond the other one.
    assert region.contains_point((found.wanted.y, 0.0))
    assert not region.contains_point((max(each.y for each in found.equilibria) + 0.1, 0.0))

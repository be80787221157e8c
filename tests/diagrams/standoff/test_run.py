"""The block diagram approaches the closed form, and does what a real loop adds to it."""

import math

import numpy as np
import pytest

from sightfield.diagrams.standoff.make_standoff import (
    MakeStandoff,
    StandoffScenario,
    measure_convergence,
    run_closed_loop,
    run_standoff,
)
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.attraction import region_of_attraction
from sightfield.systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop, wanted_equilibrium
from sightfield.systems.numerics.standoff.response import delay_margin, respond, still_integral
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid

REST = wanted_equilibrium(StandoffLoop()).y


@pytest.mark.parametrize(
    ("controller", "kd"),
    [("P", 1.0), ("PI", 1.0), ("PD", 1.0), ("PD", 2.5), ("PID", 1.0), ("PID", 2.5)],
)
def test_the_block_diagram_converges_to_the_closed_form_with_order_one(controller, kd):
    loop = StandoffLoop(controller=controller, kd=kd)
    found = measure_convergence(loop, 0.1, 0.6, [0.002, 0.001])
    assert found.errors[-1] < 1e-3
    assert found.order == pytest.approx(1.0, abs=0.1)


def test_the_printed_2_12_is_not_what_the_block_diagram_does():
    # With K_D = 2.5 its denominator is off by 1.5 (b - 1), and its integral state starts alike.
    loop = StandoffLoop(controller="PID", kd=2.5)
    times = np.linspace(0, 0.6, 3001)
    y, rate, step = [0.1], loop.rate(0.1), times[1]
    for _ in times[1:]:
        slope = loop.slope(y[-1])
        pull = 10 * slope * rate + 5 * loop.miss(y[-1]) + 2 * 1.062 * 2.5 * rate**2
        rate += step * pull / (1 - 2 * 1.062 * 2.5 * y[-1] - (loop.error.b - 1))
        y.append(y[-1] + step * rate)
    sampled = SampledPid(period=0.0002, filter_time=0.002)
    run = run_standoff(StandoffScenario(loop=loop, sampled=sampled), 0.6)
    _, corrected = run_closed_loop(loop, 0.1, 0.6, period=0.0002)
    assert np.abs(run.distance - corrected).max() < 2e-3
    assert np.abs(run.distance - np.array(y)).max() > 1e-2


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_plant_in_drake_moves_as_the_solution_in_scipy(controller):
    loop = StandoffLoop(controller=controller)
    rate = 0.0 if loop.integrates else None
    times, y = run_closed_loop(loop, 0.1, 2.0, start_rate=rate, period=0.001)
    expected = respond(loop, 0.1, integral=still_integral(loop, 0.1), duration=2.0)
    near = np.interp(expected.times, times, y)
    np.testing.assert_allclose(near, expected.y, atol=1e-5)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_starts_on_both_sides_of_each_end_go_apart_in_drake(controller):
    # An integral so strong that it has settled soon.
    loop = StandoffLoop(controller=controller, ki=10.0)
    region = region_of_attraction(loop)
    for end, inwards in ((region.low, 1), (region.high, -1)):
        if math.isfinite(end):
            _, inside = run_closed_loop(loop, end + inwards * 1e-3, 15.0, period=0.5)
            assert inside[-1] == pytest.approx(REST, abs=1e-4)
            # Some run away or into the singularity, where no solver goes on.
            outside = respond(loop, end - inwards * 1e-3).y
            assert abs(outside[-1] - REST) > 1.0


@pytest.mark.parametrize("controller", ["PD", "PID"])
def test_beyond_the_singularity_a_filtered_loop_leaves_what_the_equation_calls_stable(controller):
    loop = StandoffLoop(controller=controller)
    _, ideal = run_closed_loop(loop, 1.40, 1.0)
    assert ideal[-1] == pytest.approx(1.436, abs=0.03)
    sampled = SampledPid(period=0.0005, filter_time=0.005)
    run = run_standoff(StandoffScenario(loop=loop, sampled=sampled, start=1.40), 1.0)
    assert run.lost or abs(run.distance[-1] - 1.436) > 0.5


@pytest.mark.parametrize("feed_forward", [True, False])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_without_feed_forward_only_an_integral_makes_up_for_a_moving_evader(
    controller, feed_forward
):
    loop = StandoffLoop(controller=controller)
    scenario = StandoffScenario(loop=loop, evader_speed=0.3, feed_forward=feed_forward)
    run = run_standoff(scenario, 15.0)
    expected = REST
    if not (feed_forward or loop.integrates):
        # K_P f(y) = -v_e: as if the reference were farther by v_e / K_P.
        shifted = StandoffLoop(controller=controller, reference=0.2 + 0.3 / loop.kp)
        expected = wanted_equilibrium(shifted).y
    assert run.distance[-1] == pytest.approx(expected, abs=1e-3)
    assert run.command[-1] == pytest.approx(0.3, abs=1e-3)


def test_with_feed_forward_a_swaying_evader_is_followed_to_the_sample():
    loop = StandoffLoop(controller="P")
    runs = [
        run_standoff(
            StandoffScenario(loop=loop, start=REST, evader_sway=0.3, feed_forward=forward), 6.0
        )
        for forward in (True, False)
    ]
    with_it, without = (np.abs(run.distance - REST).max() for run in runs)
    assert with_it < 1e-3
    assert without > 0.02


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_delays_within_the_margin_settle_and_delays_beyond_it_do_not(controller):
    loop = StandoffLoop(controller=controller, kd=0.5)
    period = 0.001
    sampled = SampledPid(period=period, filter_time=0.05)
    margin = delay_margin(loop, sampled.filter_time if loop.derivative_gain else 0.0).delay
    swings = []
    for part in (0.93, 1.07):
        # Samples are held for half a period on average.
        scenario = StandoffScenario(
            loop=loop,
            sampled=sampled,
            start=REST + 1e-4,
            delay_samples=round(part * margin / period - 0.5),
        )
        distance = run_standoff(scenario, 4.0).distance - REST
        swings.append(np.abs(distance[-1000:]).max() / np.abs(distance[1000:2000]).max())
    assert swings[0] < 0.8
    assert swings[1] > 1.2


def test_noise_repeats_with_its_seed_and_has_its_size():
    def estimate(seed):
        scenario = StandoffScenario(
            loop=StandoffLoop(controller="P", kp=0.01), start=REST, noise=0.02, seed=seed
        )
        return run_standoff(scenario, 10.0).estimate

    first = estimate(1)
    np.testing.assert_array_equal(estimate(1), first)
    assert np.abs(estimate(2) - first).max() > 0.01
    assert np.std(first) == pytest.approx(0.02, rel=0.1)


def test_the_limit_holds_on_the_whole_way_and_the_integral_recovers():
    loop = StandoffLoop(controller="PI")
    sampled = SampledPid(limit=0.3)
    run = run_standoff(StandoffScenario(loop=loop, sampled=sampled, start=0.9), 20.0)
    assert np.abs(run.command).max() <= 0.3 + 1e-12
    assert run.distance[-1] == pytest.approx(REST, abs=1e-3)
    # Without anti-windup it would swing past by far more.
    assert run.distance.min() > REST - 0.05


def test_the_ports_come_in_the_order_in_which_data_flows():
    diagram = MakeStandoff(StandoffScenario(noise=0.01, evader_sway=0.1, delay_samples=2))
    names = [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())]
    assert names == [
        "evader_velocity",
        "evader_position",
        "estimate",
        "command",
        "pursuer_position",
    ]
    assert all(system.get_name() for system in diagram.GetSystems())


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"noise": -1.0}, "`noise` must be zero or positive; got -1.0"),
        ({"start": math.nan}, "`start` must be a finite number; got nan"),
        ({"delay_samples": 1.5}, r"`seed, delay_samples` must be integers; got \(0, 1.5\)"),
    ],
)
def test_bad_scenarios_are_refused(parameters, message):
    with pytest.raises(InvalidInput, match=message):
        StandoffScenario(**parameters)


def test_every_input_is_connected(unconnected):
    late = StandoffScenario(noise=0.01, evader_sway=0.1, delay_samples=2)
    assert unconnected(MakeStandoff(late)) == []

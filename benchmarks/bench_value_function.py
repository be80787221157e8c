"""How exact the value function is for its time, beside hj_reachability and the machine's bound.

Errors are of the time to go at random starts, relative to the best known time to the same box.
Every solution runs in a process of its own; times are CPU times without compilation.
"""

import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.policy import attained_times
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function

pytestmark = pytest.mark.benchmarks

HERE = Path(__file__).parent
OURS = HERE / "value_function_job.py"
PEER = HERE / "peers" / "hj_reachability_peer.py"
# Made by `make peers`.
PEER_PYTHON = Path("build/peers/hj_reachability/bin/python")

# Starts that nothing was tuned on; several times sixty, since a few beside barriers make the mean.
SEED, STARTS = int(os.environ.get("SEED", "20151")), int(os.environ.get("STARTS", "240"))
THESIS = 0.2
STEPS = tuple(map(float, os.environ.get("STEPS", "0.2 0.15 0.125 0.1").split()))
# A path that is shorter by more than that is another one.
QUICKER = 1e-3
# How far back the peer's tube reaches [s].
HORIZON = 9.0


def ask(python, script, job):
    """The answer of a script in a process of its own."""
    done = subprocess.run(
        [python, script], input=json.dumps(job), capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


def solve(step, starts):
    """Our answer, with errors of the times and how many are missing."""
    job = {
        "step": step,
        "goal": starts.goal.state,
        "tolerance": starts.goal.tolerance,
        "states": starts.states.tolist(),
    }
    return judged(ask(sys.executable, OURS, job), starts)


def solve_by_peer(step, starts):
    """The peer's answer on the same grid."""
    grid = StateGrid.of_step(step, starts.goal.state[:2])
    x_min, y_min, x_max, y_max = grid.bounds
    job = {
        "low": [x_min, y_min, 0, 0],
        "high": [x_max, y_max, math.tau, math.tau],
        "shape": [grid.x_count, grid.y_count, grid.theta_count, grid.beta_count],
        "goal": starts.goal.state,
        "tolerance": starts.goal.tolerance,
        "states": starts.states.tolist(),
        "horizon": HORIZON,
    }
    return judged(ask(PEER_PYTHON, PEER, job), starts)


def judged(answer, starts):
    """An answer with `errors` of what it found, what it `missed`, and where it is `quicker`.

    Times by words are of paths into the box: where one is shorter than the best known, that was not
    the best. `rough` errors are those of interpolation.
    """
    times, rough = (
        np.array([math.inf if each is None else each for each in answer.get(name, [])])
        for name in ("times", "interpolated")
    )
    found = np.isfinite(times)
    answer["errors"] = np.abs(times / starts.times - 1)[found]
    answer["quicker"] = int((times < starts.times * (1 - QUICKER)).sum())
    if len(rough):
        answer["rough"] = np.abs(rough / starts.times - 1)[np.isfinite(rough)]
    answer["missed"] = int((~found).sum())
    answer["beyond"] = int((~found & (starts.times > HORIZON)).sum())
    return answer


def said(answer):
    """Errors in words."""
    errors, missed = answer["errors"], answer["missed"]
    text = (
        f"mean {errors.mean():.3%}, median {np.median(errors):.4%}, "
        f"largest {errors.max():.1%}, missed {missed} of {len(errors) + missed}"
    )
    if "rough" in answer:
        rough = answer["rough"]
        text += (
            f", {answer['quicker']} quicker than the best known, "
            f"{1e3 * answer['look_up_seconds']:.1f} ms each; interpolated: mean "
            f"{rough.mean():.2%}, median {np.median(rough):.3%}"
        )
    return text


@pytest.fixture(scope="module")
def starts(random_starts):
    return random_starts(SEED, STARTS)


def test_the_thesis_grid(starts):
    ours = [solve(THESIS, starts) for _ in range(3)]
    print(f"\nvalue function, 61 x 61 x 25 x 25: {said(ours[0])}", end="")
    if not PEER_PYTHON.exists():
        seconds = np.median([each["cpu_seconds"] for each in ours])
        print(f"; {seconds:.2f} CPU s; the peer is not installed: make peers")
        return
    peer = solve_by_peer(THESIS, starts)
    ours += [solve(THESIS, starts) for _ in range(3)]
    seconds = np.median([each["cpu_seconds"] for each in ours])
    print(
        f"; {seconds:.2f} CPU s\n"
        f"hj_reachability, the same grid: {said(peer)} ({peer['beyond']} beyond its horizon of "
        f"{HORIZON:g} s); {peer['cpu_seconds']:.1f} CPU s, without {peer['compile_seconds']:.1f} "
        f"CPU s of compilation: {peer['cpu_seconds'] / seconds:.0f} times ours"
    )


def test_growth_with_refinement(starts):
    found = [solve(step, starts) for step in STEPS]
    print("\nvalue function, growth with refinement")
    for step, each in zip(STEPS, found, strict=True):
        grid = StateGrid.of_step(step)
        print(
            f"  step {step:5g} {'x'.join(map(str, reversed(grid.shape))):>16s}: {said(each)}; "
            f"{each['cpu_seconds']:.2f} CPU s, {each['peak_megabytes']:.0f} MB, "
            f"{each['megabytes_before']:.0f} MB of it before"
        )
    seconds = [each["cpu_seconds"] for each in found]
    # What four refinements alike come to: the angles' numbers are rounded.
    nodes = [each["nodes"] ** 0.25 for each in found]
    exponent, _ = np.polyfit(np.log(nodes), np.log(seconds), 1)
    medians = [np.median(each["rough"]) for each in found]
    order, _ = np.polyfit(np.log(STEPS), np.log(medians), 1)
    print(
        f"  CPU time grows as the step to the power of -{exponent:.1f}, the median of what is "
        f"interpolated as the step to the power of {order:.1f}"
    )


def test_attained_times(starts):
    """What the policy of a table takes, beside what the table promises."""
    print()
    for step in (THESIS, THESIS / 2):
        grid = StateGrid.of_step(step, starts.goal.state[:2])
        value = solve_value_function(Trailer(), starts.goal, grid)
        attained_times(value, starts.states[0])  # compiles
        began = time.process_time()
        times = attained_times(value, starts.states)
        seconds = (time.process_time() - began) / len(times)
        errors = np.abs(times / starts.times - 1)
        promised = np.abs(value.interpolated(starts.states) / starts.times - 1)
        print(
            f"times attained, step {step:g}: mean error {errors.mean():.4%}, median "
            f"{np.median(errors):.4%}, largest {errors.max():.2%}, {seconds:.3f} CPU s each; "
            f"interpolated: mean {promised.mean():.2%}, median {np.median(promised):.2%}"
        )


@njit
def add_two(a, b, part, out):
    """Two loads and a store for each element."""
    for i in range(len(out)):
        out[i] = a[i] + part * b[i]


@njit
def add_two_to(a, b, part, out):
    """Three loads and a store."""
    for i in range(len(out)):
        out[i] += a[i] + part * b[i]


@njit
def add_four(a, b, c, d, part, out):
    """Four loads and a store."""
    for i in range(len(out)):
        out[i] = a[i] + part * b[i] + part * c[i] + part * d[i]


@njit
def add_four_to(a, b, c, d, part, out):
    """Five loads and a store."""
    for i in range(len(out)):
        out[i] += a[i] + part * b[i] + part * c[i] + part * d[i]


@njit
def stream_linear(lines, rounds):
    """What a linear update loads and stores: along beta, y and x, and the best so far."""
    a, b, c, d, e, out = lines
    part = np.float32(0.5)
    for _ in range(rounds):
        add_two(a, b, part, d)
        add_two(c, d, part, e)
        add_two_to(a, e, part, out)


@njit
def stream_cubic(lines, rounds):
    """The same of a cubic update."""
    a, b, c, d, e, out = lines
    part = np.float32(0.5)
    for _ in range(rounds):
        add_four(a, b, c, e, part, d)
        add_four(a, b, c, d, part, e)
        add_four_to(a, b, d, e, part, out)


def bound(stream, rounds=20_000, length=1024):
    """Updates per second when all lines stay in the first-level cache."""
    lines = tuple(np.zeros(length, dtype=np.float32) for _ in range(6))
    stream(lines, 10)
    seconds = []
    for _ in range(7):
        began = time.process_time()
        stream(lines, rounds)
        seconds.append(time.process_time() - began)
    return rounds * length / np.median(seconds)


def test_throughput(starts):
    answer = solve(THESIS, starts)
    passes, polish = np.array(answer["pass_seconds"]), answer["polish"]
    updates = answer["computed_nodes"] * answer["controls"]
    print()
    for name, seconds, stream in (
        ("linear", passes[:-polish], stream_linear),
        ("cubic", passes[-polish:], stream_cubic),
    ):
        rate, most = updates / np.median(seconds), bound(stream)
        print(
            f"value function, {name} passes: {1e-9 * rate:.2f} billion updates (of a node by a "
            f"control) per second and core, {rate / most:.0%} of the {1e-9 * most:.2f} billion "
            f"that loading and storing allow"
        )

"""Between its keys a glide passes every sample closely, with no more keys than bends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.diagrams.visuals.glide import Glide

TOLERANCE = 0.05


def keys_of(samples: dict[int, tuple[float, ...]]) -> dict[int, tuple[float, ...]]:
    """Frames and values that a recording of samples keys, the last sample among them."""
    (first, values), *others = samples.items()
    tolerance = (TOLERANCE,) * len(values)
    glide = Glide(first, values, tolerance)
    needed = [glide.add(frame, values, tolerance) for frame, values in others]
    return dict([key for key in needed if key is not None] + glide.finish())


def worst_miss(samples: dict[int, tuple[float, ...]]) -> float:
    """How far the player passes from a sample at most."""
    keys = keys_of(samples)
    values, at = np.array(list(samples.values())), list(samples)
    played = [np.interp(at, list(keys), column) for column in np.array(list(keys.values())).T]
    return float(np.abs(values - np.array(played).T).max())


@given(
    values=st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=60),
    gaps=st.lists(st.integers(1, 5), min_size=60, max_size=60),
)
def test_every_sample_is_passed_within_the_tolerance(values, gaps):
    frames = np.cumsum(gaps)[: len(values)].tolist()
    assert worst_miss(dict(zip(frames, values, strict=True))) <= TOLERANCE + 1e-9


@given(step=st.floats(-0.01, 0.01), bend=st.floats(0, 6.3))
def test_a_smooth_curve_is_passed_within_the_tolerance(step, bend):
    angles = bend + step * np.arange(300)
    samples = {k: (np.cos(angle), np.sin(angle)) for k, angle in enumerate(angles)}
    assert worst_miss(samples) <= TOLERANCE + 1e-9
    assert len(keys_of(samples)) < 20


@pytest.mark.parametrize("frames", [range(100), range(0, 100, 7)])
def test_a_straight_line_needs_its_ends_only(frames):
    samples = {frame: (0.3 * frame, 1.0 - 0.1 * frame) for frame in frames}
    assert list(keys_of(samples)) == [frames[0], frames[-1]]


def test_a_bend_is_keyed_where_it_is():
    samples = {frame: (float(min(frame, 40)),) for frame in range(80)}
    assert list(keys_of(samples)) == [0, 40, 79]


def test_a_key_is_a_sample():
    rng = np.random.default_rng(1)
    samples = {frame: (value,) for frame, value in enumerate(rng.normal(size=200).tolist())}
    assert keys_of(samples).items() <= samples.items()


def test_a_later_value_of_the_same_frame_counts():
    glide = Glide(0, (0.0,), (TOLERANCE,))
    assert glide.add(0, (1.0,), (TOLERANCE,)) is None
    assert glide.add(3, (9.0,), (TOLERANCE,)) == (0, (1.0,))
    assert glide.add(3, (7.0,), (TOLERANCE,)) is None
    assert glide.finish() == [(3, (7.0,))]


def test_one_sample_is_one_key():
    assert keys_of({5: (1.0,)}) == {5: (1.0,)}

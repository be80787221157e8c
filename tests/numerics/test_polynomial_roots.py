"""Every crossing of zero between 0 and 1 is found, and nothing else."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.team_sight import unit_roots


def from_roots(roots, lead=1.0):
    """Coefficients from the constant upwards."""
    return lead * np.poly(roots)[::-1]


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("lead", [1.0, -3e-9, 1e12])
def test_known_roots_come_back(degree, lead):
    rng = np.random.default_rng(degree)
    for _ in range(300):
        roots = np.sort(rng.uniform(-1.0, 2.0, degree))
        if np.diff(roots).min(initial=1.0) < 0.01:
            continue  # close ones are ill-conditioned in any coefficients
        inside = roots[(roots >= 0.0) & (roots <= 1.0)]
        np.testing.assert_allclose(unit_roots(from_roots(roots, lead)), inside, atol=1e-8)


def test_agrees_with_the_eigenvalues_of_the_companion_matrix():
    rng = np.random.default_rng(0)
    counts = np.zeros(5, dtype=int)
    for _ in range(2000):
        coefficients = rng.normal(size=5) * 10.0 ** rng.uniform(-2, 2, 5)
        every = np.roots(coefficients[::-1])
        real = np.sort(every[np.abs(every.imag) < 1e-12].real)
        inside = real[(real >= 0.0) & (real <= 1.0)]
        np.testing.assert_allclose(unit_roots(coefficients), inside, atol=1e-6)
        counts[len(inside)] += 1
    assert (counts[:3] > 50).all()


def test_the_degree_may_be_lower_than_it_is_written():
    quadratic = from_roots([0.25, 0.75])
    padded = np.array([*quadratic, 0.0, 0.0])
    np.testing.assert_array_equal(unit_roots(padded), unit_roots(quadratic))
    np.testing.assert_allclose(unit_roots(padded), [0.25, 0.75], rtol=1e-15)


def test_the_ends_belong_to_the_interval():
    np.testing.assert_allclose(unit_roots(from_roots([0.0, 0.5, 1.0, 2.0])), [0.0, 0.5, 1.0])


def test_roots_of_odd_order_are_found_and_found_once():
    np.testing.assert_allclose(unit_roots(from_roots([0.5, 0.5, 0.5, 3.0])), [0.5], atol=1e-5)


def test_two_roots_close_together_are_two():
    roots = unit_roots(from_roots([0.5, 0.5 + 1e-6, -1.0, 7.0]))
    np.testing.assert_allclose(roots, [0.5, 0.5 + 1e-6], atol=1e-9)


@pytest.mark.parametrize("coefficients", [[1.0], [1.0, 0.0, 0.0], [1e-300, 1e-300], [1, -2, 1.01]])
def test_what_does_not_cross_zero_has_no_root(coefficients):
    assert len(unit_roots(np.array(coefficients, dtype=float))) == 0


def test_of_nothing_only_the_start_is_named():
    assert set(unit_roots(np.zeros(5))) == {0.0}


def test_an_interval_turned_round_has_the_roots_turned_round():
    rng = np.random.default_rng(3)
    for _ in range(200):
        roots = np.sort(rng.uniform(0.0, 1.0, 4))
        if np.diff(roots).min() < 0.02:
            continue
        back = 1.0 - unit_roots(from_roots(1.0 - roots))[::-1]
        np.testing.assert_allclose(unit_roots(from_roots(roots)), back, atol=1e-8)

"""A log is held against what was promised in it: what is broken is found, what is void is not."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.diagrams.tracking.promises import audit_promises

PERIOD = 0.5


def make_run(promised, end, *, lost=True, seen=None, withdrawn=None, assignment=None):
    """A game of one evader whose pursuers promise so much at each sample, shape (T, Np) [s]."""
    promised = np.array(promised, dtype=float)
    samples, pursuers = promised.shape
    withdrawn = np.array(withdrawn or np.zeros_like(promised), dtype=bool)
    seen = np.ones_like(promised) if seen is None else np.array(seen)
    own = np.zeros_like(promised) if assignment is None else np.array(assignment)
    times = np.where(withdrawn | (own < 0), 0.0, promised)
    return SimpleNamespace(
        times=PERIOD * np.arange(samples),
        tracking_time=end,
        lost_evader=0 if lost else None,
        log={
            "certificate": times.max(axis=1, keepdims=True),
            "guaranteed_time": promised,
            "withdrawn": withdrawn,
            "assignment": own.astype(int),
            "visibility": seen.reshape(samples, pursuers, 1) > 0,
        },
    )


def test_what_lasts_as_long_as_promised_is_kept():
    found = audit_promises(make_run([[1.6], [1.1], [0.6], [0.1], [0.0]], 2.1))
    assert found.breach == ""
    assert (found.claimed, found.lasted) == pytest.approx((1.6, 2.1))
    assert found.margin == pytest.approx(0.5)
    # A promise that grows is tried from then on.
    found = audit_promises(make_run([[0.6], [1.2], [0.7], [0.2]], 1.75))
    assert (found.claimed, found.lasted) == pytest.approx((1.2, 1.25))


def test_sight_that_is_lost_sooner_breaks_the_promise():
    found = audit_promises(make_run([[2.0], [1.5], [1.0]], 1.2))
    assert "at 0.00 s all were to be in sight for 2.00 s" in found.breach
    assert found.margin == pytest.approx(-0.8)
    ever = audit_promises(make_run([[math.inf], [math.inf]], 0.8))
    assert "for ever" in ever.breach


def test_a_promise_ends_where_its_pursuer_is_deflected():
    promised, withdrawn = [[3.0], [2.5], [0.4], [0.0]], [[0], [1], [0], [0]]
    found = audit_promises(make_run(promised, 1.6, withdrawn=withdrawn))
    assert (found.breach, found.withdrawn) == ("", 1)
    assert (found.claimed, found.lasted) == pytest.approx((0.4, 0.6))
    assert audit_promises(make_run(promised, 1.6)).breach
    # Not before it, and what is promised anew counts.
    early = make_run([[3.0], [2.5], [2.0], [1.5]], 1.2, withdrawn=[[1], [0], [0], [0]])
    assert "at 0.50 s" in audit_promises(early).breach


def test_a_promise_ends_where_its_pursuer_gets_another_evader():
    promised = [[3.0, 0.0], [0.0, 0.4], [0.0, 0.0]]
    changed = make_run(promised, 1.1, assignment=[[0, -1], [-1, 0], [-1, 0]])
    assert audit_promises(changed).breach == ""


def test_nothing_else_takes_a_promise_back():
    assert "promises 1.00 s" in audit_promises(make_run([[3.0], [1.0], [0.5]], 1.5)).breach
    back = make_run([[math.inf], [4.0]], 1.5, lost=False)
    assert "promises 4.00 s of evader 0, ever before" in audit_promises(back).breach


def test_a_pursuer_has_to_see_its_own_evader_though_another_sees_it_too():
    run = make_run(
        [[2.0, 2.0], [1.5, 1.5], [1.0, 1.0]], 1.0, lost=False, seen=[[1, 1], [1, 0], [1, 1]]
    )
    assert "at 0.50 s pursuer 1 does not see evader 0" in audit_promises(run).breach


def test_a_deflection_of_several_samples_is_one():
    withdrawn = [[0, 0], [1, 0], [1, 1], [0, 0], [1, 0]]
    run = make_run(np.ones((5, 2)), 2.0, lost=False, withdrawn=withdrawn)
    assert audit_promises(run).withdrawn == 3

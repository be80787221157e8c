"""Figure 2.34, drawn from a run."""

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from sightfield.diagrams.social.crowd_layer import agent_rgb
from sightfield.diagrams.social.report import draw_connectivity, runs

TIMES = np.arange(6.0)


def test_runs_are_the_stretches_in_which_a_state_holds():
    assert runs(TIMES, np.array([1, 1, 0, 0, 1, 1], dtype=bool)) == [(0.0, 2.0), (4.0, 1.0)]
    assert runs(TIMES, np.zeros(6, dtype=bool)) == []
    assert runs(TIMES, np.ones(6, dtype=bool)) == [(0.0, 5.0)]


def test_a_band_for_each_agent_has_its_friendships_and_its_share():
    connected = np.array([[1, 0], [1, 0], [0, 0], [0, 1], [1, 1], [1, 1]], dtype=bool)
    axes = Figure().subplots()
    draw_connectivity(axes, TIMES, connected)
    first, second = axes.collections
    assert len(first.get_paths()) == 2
    assert len(second.get_paths()) == 1
    np.testing.assert_allclose(first.get_facecolor()[0, :3], to_rgb(agent_rgb(0)))
    # The first agent is the uppermost, as in the thesis.
    assert first.get_paths()[0].vertices[:, 1].min() > second.get_paths()[0].vertices[:, 1].max()
    assert {text.get_text() for text in axes.texts} == {"67 %", "50 %"}
    assert "33 %" in axes.get_title()

"""The panel has a row for everything, and all of them are on it."""

import numpy as np
import pytest

from sightfield.diagrams.harvest.panel import Panel
from sightfield.diagrams.tracking.scene.layout import make_layout


class Places:
    """A stage on which only the places of things are noted."""

    def __init__(self):
        self.at = {}

    def place(self, path, x, y, *_):
        self.at[path] = np.array([x, y])

    def mesh(self, path, shape, colour):
        """Of what is drawn nothing is kept."""

    def raise_to(self, path, height):
        """Nor how high it is."""

    def show(self, path, shown):
        """Nor whether it is seen."""


@pytest.mark.parametrize(("combines", "carts"), [(1, 0), (3, 1), (12, 6), (30, 10)])
def test_however_many_machines_there_are_their_rows_are_on_the_panel(combines, carts):
    stage = Places()
    layout = make_layout((0.0, 0.0, 400.0, 275.0), 0.0)
    Panel(stage, layout, combines, carts, None)
    _, bottom, _, top = layout.panel_bounds
    rows = [stage.at[f"tanks/{n}"][1] for n in range(combines)]
    rows += [stage.at[f"loads/{k}"][1] for k in range(carts)]
    rows += [stage.at[f"panel/{name}"][1] for name in ("delivered", "lost")]
    assert rows == sorted(rows, reverse=True)
    assert bottom < rows[-1]
    assert rows[0] < top
    # Those of a kind are evenly apart, as far as letters are high where there is room.
    apart = -np.diff(rows[:combines])
    assert apart == pytest.approx(apart.mean() if len(apart) else 0.0)
    if combines + carts < 10:
        assert (-np.diff(rows) > 0.0175 * layout.span).all()

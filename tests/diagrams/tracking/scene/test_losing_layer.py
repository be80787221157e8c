"""Where a pursuer would lose an evader: in its sight, in colours by time, moving with it."""

import numpy as np
import pytest
import shapely

from sightfield.diagrams.tracking.scene.floor_layers import LosingLayer
from sightfield.diagrams.tracking.scene.layout import LOSING, make_layout
from sightfield.diagrams.tracking.scene.panel import Panel, draw_legend
from sightfield.diagrams.tracking.solved_game import losing_strips
from sightfield.diagrams.visuals.meshes import Mesh
from sightfield.diagrams.visuals.stage import Stage
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.visibility_polygon import visibility_polygon
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

ROOM = make_world([(0, 0), (4, 0), (4, 4), (2.03, 4), (2.03, 2.03), (0, 2.03)])
PURSUER = np.array([0.6, 1.1])


@pytest.fixture(scope="module")
def table():
    return solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.2)


def polygon_from(point):
    return visibility_polygon(build_edge_index(ROOM), point)


@pytest.fixture
def stage(meshcat_log):
    return Stage(meshcat_log, "/stage", recording=False, period=0.05, tolerance=1e-3)


def test_strips_are_the_nodes_in_sight_at_which_the_table_has_an_end(table):
    strips, kept = losing_strips(table, polygon_from, PURSUER)
    times, points = table.times_from(PURSUER), table.evader_grid.points
    seen = shapely.Polygon(polygon_from(PURSUER))
    expected = {}
    for row, column in np.argwhere(np.isfinite(times)):
        if seen.contains(shapely.Point(points[row, column])):
            expected[row, column] = times[row, column]
    assert len(expected) > 50
    found = {}
    for (x0, y0, x1, y1), time in zip(strips, kept, strict=True):
        inside = (points > [x0, y0]).all(axis=-1) & (points < [x1, y1]).all(axis=-1)
        for node in np.argwhere(inside):
            assert tuple(node) not in found
            found[tuple(node)] = time
    assert found == expected


def test_off_the_map_there_are_none(table):
    strips, times = losing_strips(table, polygon_from, np.array([1.0, 3.0]))
    assert len(strips) == len(times) == 0


def test_each_band_of_times_has_the_area_of_its_strips(stage, meshcat_log):
    strips = np.array([[0, 0, 1, 1], [1, 0, 3, 1], [0, 2, 1, 2.5], [2, 2, 3, 3]], dtype=float)
    layer = LosingLayer(
        stage, make_layout((0, 0, 4, 4), 0.1), lambda place: (strips, np.array([0, 1, 3, 8.0]))
    )
    layer.update(0.0, PURSUER)
    areas = []
    for band in range(3):
        areas.append(Mesh(*meshcat_log.meshes[f"/stage/losing/{band}/0"]).area)
    np.testing.assert_allclose(areas, [3.0, 0.5, 1.0])


def test_it_is_drawn_where_the_pursuer_has_moved_and_hidden_without_one(stage, meshcat_log):
    asked = []

    def losing_set(place):
        asked.append(place.copy())
        return np.array([[0.0, 0.0, 1.0, 1.0]]), np.array([1.0])

    layer = LosingLayer(stage, make_layout((0, 0, 4, 4), 0.1), losing_set)
    for time, x in ((0.0, 1.0), (0.25, 1.0), (0.5, 2.0), (0.55, 3.0)):
        layer.update(time, np.array([x, 1.0]))
    # Not again from the same place, and not twice in a period.
    assert [place[0] for place in asked] == [1.0, 2.0]
    layer.update(1.0, None)
    assert ("/stage/losing/0/0", "visible") in meshcat_log.sent[-1:]


@pytest.mark.parametrize(("certificate", "visible"), [(12.3, "digits"), (np.inf, "ever")])
def test_the_panel_counts_the_certificate(stage, meshcat_log, certificate, visible):
    panel = Panel(
        stage, make_layout((0, 0, 4, 4), 0.1), pursuers=1, evaders=1, certificate="certified for"
    )
    shown = {}
    show = stage.show
    stage.show = lambda path, whether: (shown.__setitem__(path, whether), show(path, whether))
    panel.update(0.0, np.array([[True]]), np.array([0]), 0.5, certificate)
    assert shown[f"certificate/{visible}"]
    assert shown["certificate/digits"] != shown["certificate/ever"]
    if visible == "digits":
        for place, digit in enumerate((3, 2, 1)):
            assert shown[f"certificate/digits/{place}/{digit}"]


def test_the_legend_names_every_colour(stage, meshcat_log, monkeypatch):
    colours, send = {}, meshcat_log.SetTriangleMesh

    def noted(path, vertices, faces, rgba):
        colours[path] = rgba
        send(path, vertices, faces, rgba)

    monkeypatch.setattr(meshcat_log, "SetTriangleMesh", noted)
    draw_legend(stage, make_layout([0, 0, 4, 4], 0.1), (4.0, 0.0, 6.0), 1.0, losing=True)
    shown = [colours[f"/stage/legend/{k}/sample"] for k in range(6, 9)]
    assert shown == list(LOSING)

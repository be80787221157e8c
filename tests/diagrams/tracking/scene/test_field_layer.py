"""The arrows stand on a lattice of the world, where a robot can be, around the chosen pursuer."""

import numpy as np
import pytest
import shapely

from sightfield.diagrams.tracking.scene.floor_layers import FieldLayer
from sightfield.diagrams.tracking.scene.layout import make_layout
from sightfield.diagrams.visuals.stage import Stage
from sightfield.systems.numerics.geometry.world import world_from_polygon

EVADERS = np.array([[3.0, 1.0]])
CHASE, IDLE = np.array([0]), np.array([-1])


@pytest.fixture
def grown(arena):
    return world_from_polygon(arena.polygon.buffer(-0.12))


@pytest.fixture
def layer(arena, grown, meshcat_log):
    stage = Stage(meshcat_log, "/stage", recording=False, period=0.05, tolerance=1e-3)

    def toward(pursuer, points, evaders, assignment):
        return evaders[assignment[pursuer]] - points

    return FieldLayer(stage, make_layout(arena.bounds, 0.12), [grown], toward)


def as_set(points: np.ndarray) -> set[tuple[float, float]]:
    return {(round(x, 9), round(y, 9)) for x, y in points}


def test_its_points_are_free_and_around_the_centre(layer, grown):
    centre = np.array([1.2, 1.0])
    points = layer.lattice(centre)
    assert len(points) > 50
    assert shapely.covers(grown.polygon, shapely.points(points)).all()
    assert np.hypot(*(points - centre).mean(axis=0)) < 0.3


def test_its_points_stay_where_they_are_when_the_pursuer_moves(layer):
    centre, moved = np.array([0.8, 0.8]), np.array([0.83, 0.81])
    here, there = layer.lattice(centre), layer.lattice(moved)
    near = here[np.hypot(*(here - moved).T) < np.hypot(*(here - centre).T).max() - 0.05]
    assert as_set(near) <= as_set(there)


def test_outside_of_the_free_region_there_are_none(layer):
    assert layer.lattice(np.array([50.0, 50.0])).shape == (0, 2)


def test_arrows_point_along_the_field(layer, meshcat_log):
    layer.update(0.0, 0, np.array([[1.0, 0.8]]), EVADERS, CHASE)
    vertices, _ = meshcat_log.meshes["/stage/field/0"]
    tip, _, waist, _ = vertices[:2].T.reshape(-1, 4, 2).swapaxes(0, 1)
    along, wanted = tip - waist, EVADERS[0] - waist
    cross = along[:, 0] * wanted[:, 1] - along[:, 1] * wanted[:, 0]
    np.testing.assert_allclose(cross, 0.0, atol=1e-9)
    assert (np.einsum("ij,ij->i", along, wanted) > 0).all()


def test_a_pursuer_that_chases_nobody_has_no_field(layer, meshcat_log):
    layer.update(0.0, 0, np.array([[1.0, 0.8]]), EVADERS, IDLE)
    assert meshcat_log.meshes == {}


def test_a_pursuer_without_free_points_around_it_has_no_arrows(layer, meshcat_log):
    layer.update(0.0, 0, np.array([[50.0, 50.0]]), EVADERS, CHASE)
    assert meshcat_log.meshes == {}

"""The picture of a corner shows its regions, its players and its field."""

import math

import cv2
import numpy as np
import pytest
from matplotlib.image import AxesImage
from matplotlib.quiver import Quiver

from sightfield.diagrams.tracking.corner_picture import (
    REGIONS,
    draw_corner_game,
    save_corner_picture,
)
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.corner_policies import BLOCKED, FIELDS, partition

PURSUER, EVADER = (1.0, -1.5), (-0.2, 0.6)


def test_every_region_has_a_colour_of_its_own():
    colours = [colour for colour, _ in REGIONS.values()]
    assert len(set(colours)) == len(REGIONS)
    assert list(REGIONS) == sorted(REGIONS)


def test_the_partition_is_painted_region_by_region():
    figure = draw_corner_game(math.pi / 2, 0.5, PURSUER, EVADER)
    axes = figure.axes[0]
    (image,) = (artist for artist in axes.get_children() if isinstance(artist, AxesImage))
    codes = np.asarray(image.get_array())
    low, high, bottom, top = image.get_extent()
    for x, y in ((0.1, 0.3), (-0.1, 0.8), (0.85, 0.1), (1.0, 1.0), (2.0, 2.0), (-2.0, 1.0)):
        column = int((x - low) / (high - low) * codes.shape[1])
        row = int((y - bottom) / (top - bottom) * codes.shape[0])
        assert codes[row, column] == partition(PURSUER, (x, y), math.pi / 2, 0.5)
    # Blocked, in the star region and so on: each code gets the colour that the legend gives it.
    shades = image.to_rgba(np.array([list(REGIONS)]), bytes=True)[0, :, :3]
    painted = ["#" + "".join(f"{channel:02x}" for channel in shade) for shade in shades]
    assert painted == [colour for colour, _ in REGIONS.values()]
    assert codes[0, 0] == BLOCKED


@pytest.mark.parametrize("field", FIELDS)
def test_arrows_point_as_the_field_does(field):
    figure = draw_corner_game(1.0, 0.5, (-0.5, -1.2), (0.3, 0.5), field)
    (arrows,) = (artist for artist in figure.axes[2].get_children() if isinstance(artist, Quiver))
    assert np.hypot(arrows.U, arrows.V) == pytest.approx(1)
    assert len(arrows.U) > 100


def test_players_at_the_corner_can_be_drawn():
    assert draw_corner_game(1.0, 0.5, (0.0, 0.0), (0.0, 0.0)).axes[0].get_xlim() == (-1, 1)


def test_a_picture_is_a_readable_png(tmp_path):
    save_corner_picture(tmp_path / "corner.png", 2.0, 0.3, PURSUER, EVADER)
    picture = cv2.imread(str(tmp_path / "corner.png"))
    assert picture is not None
    assert picture.shape[0] > 400
    assert picture.shape[1] > 1200
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > len(REGIONS)


def test_a_player_in_the_obstacle_is_refused():
    with pytest.raises(InvalidInput, match="`evader` must not be inside the obstacle"):
        draw_corner_game(1.0, 0.5, PURSUER, (-1.0, -0.5))

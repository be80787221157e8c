"""What is matched, aligned and recognised is as recorded, as far as features are the same."""

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.social.landmarks.landmark_pictures import landmark_picture
from sightfield.systems.numerics.social.recognition.alignment import align
from sightfield.systems.numerics.social.recognition.matching import (
    Matches,
    find_square,
    homography_of,
    map_square,
    match,
)
from sightfield.systems.numerics.social.recognition.recognition import recognise
from sightfield.systems.numerics.social.recognition.references import (
    MARKER,
    FeatureFinder,
    make_references,
)

SQUARE = np.array([[200.0, 150.0], [320.3, 170.2], [320.1, 280.4], [199.8, 300.6]])
LARGE = np.array([[320.5, 90.0], [610.2, 35.0], [610.0, 415.0], [320.6, 360.0]])
SMALL = np.array([[60.5, 190.0], [84.2, 188.0], [84.0, 221.0], [60.6, 219.0]])
# Partly outside the frame.
LOW = np.array([[300.2, 421.0], [380.3, 425.5], [380.9, 519.0], [299.5, 513.8]])
CUT = np.array([[590.5, 190.0], [700.2, 175.0], [700.0, 295.0], [590.6, 280.0]])


def matches_on(corners, count, seed, deviation=0.7):
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.05, 0.95, (count, 2))
    pixels = map_square(homography_of(corners), places) + rng.normal(0, deviation, (count, 2))
    return Matches(np.full(count, 5), places, pixels)


@pytest.mark.parametrize(
    ("corners", "fine"),
    [(SQUARE, 3), (LARGE, 2), (SMALL, 4), (CUT, 3), (LOW, 3)],
    ids=["whole", "large", "small", "cut", "low"],
)
def test_squares_are_aligned_as_recorded(corners, fine, paste, as_recorded):
    picture = paste((5, corners), fine=fine)
    picture[240:262, 40:340] = 30
    light = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    reference = cv2.cvtColor(landmark_picture(5), cv2.COLOR_RGB2GRAY).astype(np.float32)
    begun = corners + np.random.default_rng(1).normal(0, 1.0, (4, 2))
    for seed, count in ((2, 9), (3, 40)):
        found = align(light, reference, begun, matches_on(corners, count, seed, 1.3))
        as_recorded(found, f"with {count}", relative=1e-2)


def test_squares_are_found_as_recorded(as_recorded):
    true = matches_on(SQUARE, 30, 4)
    rng = np.random.default_rng(5)
    false = Matches(np.full(9, 5), rng.uniform(0, 1, (9, 2)), rng.uniform(0, 480, (9, 2)))
    both = Matches(
        *(
            np.concatenate(pair)
            for pair in zip(vars(true).values(), vars(false).values(), strict=True)
        )
    )
    as_recorded(find_square(both), relative=1e-4)


@pytest.mark.parametrize("method", ["sift", "orb"])
def test_references_and_matches_are_as_recorded(method, paste, as_recorded):
    references = make_references({3: landmark_picture(3), 8: landmark_picture(8)}, method)
    grey = cv2.cvtColor(paste((3, SQUARE), (8, LARGE)), cv2.COLOR_RGB2GRAY)
    features = FeatureFinder(method).find(grey)
    found = match(features, references)
    # A feature more or less, as processors round, is no other result.
    for name, value in {
        "starts": references.starts,
        "places": references.points.sum(axis=0),
        "squares": (references.points**2).sum(axis=0),
        "descriptors": np.abs(references.descriptors).sum(),
        "pictures": [each.sum() for each in references.pictures.values()],
        "features": [*features.points.sum(axis=0), np.abs(features.descriptors).sum()],
        "matches": [np.count_nonzero(found.subject == each) for each in (3, 8)],
        "matched": [*found.place.sum(axis=0), *found.pixel.sum(axis=0)],
    }.items():
        as_recorded(value, name, relative=3e-2)
    lengths = np.linalg.norm(references.descriptors, axis=1)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-5)


def test_a_picture_is_recognised_as_recorded(paste, references, as_recorded):
    left = SQUARE - [170.0, 10.0]
    picture = paste((5, SQUARE), (2, LARGE), (MARKER, left))
    picture[200:320, 150:205] = 90
    found = recognise(picture, references).detections
    as_recorded([(each.subject, each.stance, len(each.corners)) for each in found], "what")
    as_recorded([each.corners for each in found], "where", relative=1e-3)
    as_recorded([[each.correlation, each.visible] for each in found], "how well", relative=1e-2)

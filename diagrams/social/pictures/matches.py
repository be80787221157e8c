"""A posted picture with what was recognised in it, beside the references that it matched."""

import math

import cv2
import numpy as np

from ....systems.numerics.errors import InvalidInput
from ....systems.numerics.social.landmarks.landmark_pictures import (
    landmark_picture,
    marker_picture,
)
from ....systems.numerics.social.landmarks.maze import Maze
from ....systems.numerics.social.localisation.location import Location, Reading
from ....systems.numerics.social.recognition.picture_files import decode_picture
from ....systems.numerics.social.recognition.recognition import LandmarkDetection, Stance
from ....systems.numerics.social.recognition.references import MARKER

# Red, green, blue of landmarks, of those that are not trusted, and of the evader.
_LANDMARK, _DOUBTED, _EVADER = (0, 150, 60), (220, 130, 0), (225, 30, 40)
_PAPER, _INK = (250, 250, 250), (40, 40, 40)
# Drawn so many times larger than the picture, for thin lines.
_SCALE = 2
_THUMB, _GAP, _FOOT = 200, 16, 60
# At most so many of a subject's matches are drawn.
_LINES = 18
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_detections(picture: np.ndarray, detections: tuple[LandmarkDetection, ...]) -> np.ndarray:
    """A picture with the outlines of what was recognised, each with its name.

    Args:
        picture: Red, green, blue, shape (height, width, 3), uint8; stays as it is.
        detections: Of `recognise`.
    """
    drawn = np.ascontiguousarray(picture).copy()
    _outline(drawn, detections, 1)
    return drawn


def draw_reading(reading: Reading, maze: Maze) -> np.ndarray:
    """A picture, its references below it with lines between matched points, and what it tells.

    Args:
        reading: Of `read_picture`.
        maze: Whose camera took it.

    Returns:
        Red, green, blue, shape (h, w, 3), uint8; grey with words if it is no picture.
    """
    camera = maze.camera
    width, height = _SCALE * camera.width, _SCALE * camera.height
    sheet = np.full((height + _THUMB + 2 * _GAP + _FOOT, width, 3), _PAPER, np.uint8)
    try:
        picture = decode_picture(reading.picture.data, camera.width, camera.height)
        sheet[:height] = cv2.resize(picture, (width, height), interpolation=cv2.INTER_LINEAR)
    except InvalidInput:
        sheet[:height] = 200
    detections = reading.recognition.detections
    room = max(1, (width - _GAP) // (_THUMB + _GAP))
    # From left to right as in the picture, so that few lines cross.
    in_order = sorted(detections, key=lambda each: float(each.corners[:, 0].mean()))
    for k, each in enumerate(in_order[:room]):
        left, top = _GAP + k * (_THUMB + _GAP), height + _GAP
        known = marker_picture() if each.subject == MARKER else landmark_picture(each.subject)
        sheet[top : top + _THUMB, left : left + _THUMB] = cv2.resize(
            known, (_THUMB, _THUMB), interpolation=cv2.INTER_AREA
        )
        shown = np.linspace(0, len(each.places) - 1, min(_LINES, len(each.places))).astype(int)
        ends = np.rint(each.places[shown] * _THUMB + [left, top]).astype(int)
        starts = np.rint(_on_sheet(each.pixels[shown])).astype(int)
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            cv2.line(sheet, start, end, _colour(each), 1, cv2.LINE_AA)
            cv2.circle(sheet, start, 3, _colour(each), 1, cv2.LINE_AA)
    _outline(sheet, detections, _SCALE)
    place = (_GAP, sheet.shape[0] - 20)
    cv2.putText(sheet, _words(reading), place, _FONT, 0.75, _INK, 1, cv2.LINE_AA)
    return sheet


def _on_sheet(pixels: np.ndarray) -> np.ndarray:
    """Where pixels are on the enlarged picture, whose pixels' centres count from 0 as well."""
    return _SCALE * (pixels + 0.5) - 0.5


def _outline(sheet: np.ndarray, detections: tuple[LandmarkDetection, ...], scale: int) -> None:
    fine = 16
    for each in detections:
        corners = scale * (each.corners + 0.5) - 0.5
        points = np.clip(np.rint(corners * fine), -(2**20), 2**20).astype(np.int32)
        cv2.polylines(sheet, [points], True, _colour(each), scale, cv2.LINE_AA, 4)
        name = "evader" if each.subject == MARKER else str(each.subject)
        # Above its top edge, and inside the picture.
        x, y = corners.min(axis=0)
        place = (max(int(x), 2), max(int(y) - 5, 9 * scale + 4))
        for colour, width in ((_PAPER, 3 * scale), (_colour(each), scale)):
            cv2.putText(sheet, name, place, _FONT, 0.4 * scale, colour, width, cv2.LINE_AA)


def _colour(detection: LandmarkDetection) -> tuple[int, int, int]:
    if detection.subject == MARKER:
        return _EVADER
    return _LANDMARK if detection.stance is Stance.UPRIGHT else _DOUBTED


def _words(reading: Reading) -> str:
    location: Location = reading.location
    who = f"agent {reading.picture.agent + 1}"
    start = f"{who}, {reading.picture.time:.1f} s: {location.outcome.words}"
    if location.outcome.has_location:
        x, y = location.position
        doubt = math.sqrt(float(np.linalg.eigvalsh(location.covariance)[-1]))
        start += f" at ({x:.3f}, {y:.3f}) m, +- {1000 * doubt:.0f} mm"
    if location.camera is not None:
        x, y, heading = location.camera.pose
        start += f"; camera at ({x:.3f}, {y:.3f}) m, {math.degrees(heading):.1f} deg"
    return start

"""Turns on narrow ground are as they were recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.turns import words
from sightfield.systems.numerics.harvest.turns.borders import StandingCrop, make_borders
from sightfield.systems.numerics.harvest.turns.ground import Ground
from sightfield.systems.numerics.harvest.turns.turn import (
    combine_footprint,
    motion_of,
    search_lattice,
    turn_between,
)

COMBINE = Combine(
    header_width=7.3, header_depth=1.7, turning_radius=6.1, length=6.7, width=3.3, speed=1.7,
    acceleration=0.45,
)  # fmt: skip
POND = [(30, 22), (34, 18), (41, 21), (40, 28), (33, 29)]
FIELD = Field(make_world([(0, 0), (90, 3), (84, 52), (40, 44), (5, 50)], [POND]), margin=2.7)
GROUND = Ground(FIELD.ground)
STAND = Field(make_world([(48.3, 7.1), (70.2, 9.4), (66.6, 27.2), (50.9, 30.3)])).polygon


def told(path):
    return None if path is None else [path.poses, path.gears]


def poses_on_ground(rng, count, crop=None):
    found = []
    while len(found) < count:
        pose = rng.uniform([0, 0, -4], [90, 52, 4])
        if GROUND.admits_pose(pose.tolist(), combine_footprint(COMBINE), crop):
            found.append(pose)
    return np.array(found)


def test_the_ground_and_the_footprint_are_as_recorded(as_recorded):
    as_recorded(make_borders(FIELD.ground), "borders")
    as_recorded(combine_footprint(COMBINE), "footprint")
    as_recorded(combine_footprint(Combine(header_width=3.7, length=9.1)), "narrow footprint")


def test_all_words_to_a_pose_are_as_recorded(as_recorded):
    for number, pose in enumerate([(2.3, -1.1, 0.7), (-0.6, 0.9, 2.9), (5.1, 3.2, -1.3)]):
        turns, lengths = np.zeros((words.WORD_COUNT, 3)), np.zeros((words.WORD_COUNT, 3))
        as_recorded([words.write_words(*pose, turns, lengths), turns, lengths], f"{number}")


@pytest.mark.parametrize("with_crop", [False, True])
def test_turns_between_random_poses_are_as_recorded(with_crop, as_recorded):
    crop = StandingCrop(STAND) if with_crop else None
    rng = np.random.default_rng([4, with_crop])
    poses = poses_on_ground(rng, 28, crop)
    found = [
        told(turn_between(start, goal, GROUND, COMBINE, crop=crop, expansions=400))
        for start, goal in zip(poses[:14], poses[14:], strict=True)
    ]
    as_recorded(found)


@pytest.mark.parametrize("gears", [(1, 1), (0, -1), (-1, 0)])
def test_a_way_found_by_the_search_is_as_recorded(gears, as_recorded):
    crop = StandingCrop(STAND)
    site = GROUND.site(combine_footprint(COMBINE), crop)
    start, goal = np.array([12.3, 12.1, 0.4]), np.array([78.2, 40.6, -1.1])
    as_recorded(search_lattice(site, motion_of(COMBINE), start, goal, gears, 3000))


def test_in_a_narrow_lane_the_way_is_as_recorded(as_recorded):
    lane = Field(make_world([(0, 0), (61, 7), (58.2, 21.3), (1, 13.9)]), margin=0.3)
    start, goal = (12.2, 8.9, 0.13), (48.1, 12.3, math.pi + 0.17)
    as_recorded(told(turn_between(start, goal, Ground(lane.ground), COMBINE)))

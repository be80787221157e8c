"""Cameras, estimators and the tracker in diagrams give what was recorded, at their limits too."""

import numpy as np
import pytest
import shapely
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.vision.estimation.calibration import Readings, calibrate
from sightfield.systems.numerics.vision.estimation.shell_detection import Outcome
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, project_omni
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings, shell_of
from sightfield.systems.vision.evader_tracker import EvaderTracker
from sightfield.systems.vision.omni_camera import OmniCameraSensor
from sightfield.systems.vision.shell_estimator import ShellEstimator

WORLD = make_world(
    [[-0.3, 0.1], [4.1, -0.2], [3.8, 2.9], [0.2, 3.1]],
    [[[1.5, 1.1], [2.4, 1.0], [2.3, 1.9], [1.6, 2.0]]],
)
OUTPUTS = ("evader_position", "evader_covariance", "evader_velocity", "evader_known")


class Bench:
    """A tracker of two evaders with two cameras, fed by hand."""

    def __init__(self, **settings):
        usual = {"colours": ["red", "blue"], "speed": 0.2, "period": 0.1, "cells": 300}
        self.system = EvaderTracker(
            WORLD, shrink_world(WORLD, 0.12), cameras=2, **{**usual, **settings}
        )
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        for camera in range(2):
            self.show(camera, -1, 0.0, [None, None])

    def show(self, camera, number, time, spots, outcome=Outcome.NO_BLOB, pose=(0.5, 0.5, 0.0)):
        seen = [spot is not None for spot in spots]
        unknown = np.diag([np.inf, np.inf])
        for name, values in (
            ("position", [spot or (np.nan, np.nan) for spot in spots]),
            ("covariance", [[[1e-4, 2e-5], [2e-5, 3e-4]] if s else unknown for s in seen]),
            ("valid", seen),
            ("outcome", [Outcome.SEEN if s else outcome for s in seen]),
            ("frame", [number, time, 1.0]),
            ("exposure_pose", pose),
        ):
            port = self.system.GetInputPort(f"{name}_{camera}")
            port.FixValue(self.context, np.array(values, dtype=float).ravel())

    def read(self):
        told = {name: self.system.GetOutputPort(name).Eval(self.context) for name in OUTPUTS}
        cells = self.system.GetOutputPort("evader_set").Eval(self.context)
        return told | {"evader_set": cells}


@pytest.mark.parametrize("colours", [["red", "blue"], ["red", "red"]])
def test_what_a_tracker_says_of_two_evaders_is_as_recorded(colours, as_recorded):
    bench = Bench(colours=colours, delay=0.04, turning_time=0.3, certain_range=(0.4, 2.0))
    told = {"0.0": bench.read()}
    for k in range(26):
        now = 0.1 * k
        bench.simulator.AdvanceTo(now)
        one = (0.7 + 0.12 * now, 2.3 - 0.1 * now) if k < 14 or k > 19 else None
        other = (3.3 - 0.05 * now, 0.5 + 0.15 * now) if k % 4 else None
        bench.show(0, k, now, [one, other], pose=(0.6, 0.5, 0.2))
        if k % 3 == 0:
            doubt = Outcome.NO_SHELL_SHAPE if k > 9 else Outcome.NOT_ANOTHER
            bench.show(1, k, now - 0.05, [None, other], doubt, pose=(3.2, 2.4, 1.0))
        if k in (3, 15, 18, 25):
            for late in (0.039, 0.041):
                bench.simulator.AdvanceTo(now + late)
                told[f"{now + late:.3f}"] = bench.read()
    as_recorded(told, relative=1e-5)


def test_a_tracker_s_last_estimate_is_where_an_evader_can_be():
    bench = Bench()
    for k in range(12):
        bench.simulator.AdvanceTo(0.1 * k)
        bench.show(0, k, 0.1 * k, [(1.3 + 0.02 * k, 0.9 + 0.005 * k), None])
    bench.simulator.AdvanceTo(1.45)
    x, y, *nowhere = bench.read()["evader_position"]
    (free,) = shrink_world(WORLD, 0.12)
    from_wall = free.polygon.exterior.union(free.polygon.interiors[0])
    assert shapely.distance(from_wall, shapely.Point(x, y)) < 1e-9
    west, south, east, _ = free.polygon.bounds
    # One that was never seen is as far outside as the world is wide.
    assert nowhere == pytest.approx([west - (east - west), south - (east - west)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shell_radius": 0.0}, "`shell_radius` must be positive"),
        ({"body_radius": 0.0}, "`body_radius` must be positive"),
        ({"turning_time": 0.0}, "`turning_time` must be positive"),
        ({"certain_range": (0.0, 1.0)}, "`certain_range` must be"),
        ({"certain_range": (1.0, 1.0)}, "`certain_range` must be"),
        ({"cells": 99}, "`cells` must be at least 100; got 99"),
    ],
)
def test_a_tracker_s_numbers_end_where_they_say(change, message):
    with pytest.raises(InvalidInput, match=message):
        Bench(**change)


def test_evaders_that_stand_for_ever_are_tracked_as_recorded(as_recorded):
    bench = Bench(speed=0.0, delay=0.0)
    bench.show(0, 0, 0.0, [(0.7, 0.7), (3.0, 2.0)])
    bench.simulator.AdvanceTo(0.35)
    told = bench.read()
    assert told["evader_known"].tolist() == [1, 1]
    as_recorded(told, relative=1e-5)


OPTICS = OmniCamera(width=200, height=160, focal_length=270.0, centre=(101.5, 78.0))
SHELLS = [shell_of("red", radius=0.12), shell_of("green")]
SCENE = Surroundings(world=make_world([[-2, -2], [2.5, -2], [2.5, 2], [-2, 2.3]]))


def sensor_of(**settings):
    usual = {"own_shell": Shell(top=0.18, colour=(60, 60, 60)), "period": 0.25}
    sensor = Sensor(noise=2.0, seed=4, drop_share=0.4)
    return OmniCameraSensor(OPTICS, sensor, SCENE, SHELLS, **{**usual, **settings})


def test_pictures_of_a_camera_in_a_diagram_are_as_recorded(as_recorded):
    system = sensor_of()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    told = {}
    for k, now in enumerate((0.0, 0.2, 0.3, 0.55, 0.8, 1.3)):
        system.GetInputPort("pose").FixValue(context, [0.1 * k, -0.2 * k, 0.4 * k])
        places = [0.9, 0.3 + 0.1 * k, -0.8, -0.5]
        system.GetInputPort("shell_position").FixValue(context, places)
        simulator.AdvanceTo(now)
        frame, pose = (system.GetOutputPort(n).Eval(context) for n in ("frame", "exposure_pose"))
        image = system.GetOutputPort("image").Eval(context).data
        told[f"{now}"] = [frame, pose, image.copy()]
    as_recorded(told, relative=1e-5)


def test_a_camera_carries_a_shell_up_to_its_mirror():
    lowest = OPTICS.pinhole_height + OPTICS.mirror_distance
    sensor_of(own_shell=Shell(top=lowest - 1e-9))
    with pytest.raises(InvalidInput, match=r"`own_shell` must stay below the mirror, 0\.37 m"):
        sensor_of(own_shell=Shell(top=lowest))
    assert sensor_of(own_shell=None).period == 0.25


@pytest.mark.parametrize("model", ["exact", "thesis"])
def test_what_an_estimator_says_of_a_picture_is_as_recorded(model, as_recorded):
    bearing = np.tile(2 * np.pi * np.arange(5) / 5, 5)
    distance = np.repeat([0.3, 0.5, 0.8, 1.1, 1.5], 5)
    at = np.column_stack([np.cos(bearing), np.sin(bearing)]) * distance[:, None]
    pixels, _ = project_omni(OPTICS, np.column_stack([at, np.full(25, SHELLS[0].base)]))
    readings = Readings(distance=distance, bearing=bearing, pixels=pixels)
    sizes = {"base": 0.04, "shell_radius": 0.12, "shell_top": 0.2}
    calibration = calibrate(readings, camera=OPTICS, **sizes)
    system = ShellEstimator(calibration, ["blue", "red"], model=model)
    context = system.CreateDefaultContext()
    camera = sensor_of()
    simulator = Simulator(camera)
    taken = simulator.get_mutable_context()
    camera.GetInputPort("pose").FixValue(taken, [0.2, -0.1, 0.7])
    camera.GetInputPort("shell_position").FixValue(taken, [0.7, 0.5, -1.0, -0.8])
    simulator.AdvanceTo(0.3)
    image = camera.GetOutputPort("image").Eval(taken)
    system.GetInputPort("image").FixValue(context, image)
    system.GetInputPort("pose").FixValue(context, [0.2, -0.1, 0.7])
    told = {
        name: system.GetOutputPort(name).Eval(context)
        for name in ("position", "covariance", "valid", "range_bearing", "outcome")
    }
    assert told["valid"].tolist() == [0.0, 1.0]
    as_recorded(told, relative=1e-3)

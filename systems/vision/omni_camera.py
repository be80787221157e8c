"""An omni-directional camera on a robot, as a source of pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ..drake_parts import AbstractValue, read
from ..numerics.errors import require, require_positive
from ..numerics.vision.omni_optics import OmniCamera, make_ray_table
from ..numerics.vision.rendering import render
from ..numerics.vision.sensor import Sensor, expose, is_dropped
from ..numerics.vision.surroundings import Shell, Surroundings


@dataclass(frozen=True, eq=False)
class Exposure:
    """What a picture is drawn from.

    Attributes:
        number: Of the picture, or -1 before the first.
        time: When it was taken [s].
        arrived: Whether the latest picture arrived; this is it then.
        pose: Of the camera: x, y [m], heading [rad], shape (3,).
        positions: Of the shells, shape (2 M,) [m].
    """

    number: int
    time: float
    arrived: bool
    pose: np.ndarray
    positions: np.ndarray


class OmniCameraSensor(LeafSystem):
    """Takes pictures of floor, walls and the other robots' shells at the camera's rate.

    At each tick k of the period the poses are sampled and, unless the picture is lost, held:
    `image` is what they look like, drawn when it is first asked for, and stays until the next
    picture arrives. It is black before the first. `frame` holds the number k of the picture that
    `image` shows, or -1 before the first; when it was taken; and 1 if the latest picture arrived,
    0 if it was lost. `exposure_pose` is where the robot was when the picture was taken.

    .. pydrake_system::

        name: OmniCameraSensor
        input_ports:
        - pose
        - shell_position
        output_ports:
        - image
        - frame
        - exposure_pose

    ==============  ===========  =========  =======  ===========
    port            size         unit       frame    feedthrough
    ==============  ===========  =========  =======  ===========
    pose            3            m, m, rad  world    -
    shell_position  2 M          m          world    -
    image           ImageRgba8U  -          picture  -
    frame           3            -, s, -    -        -
    exposure_pose   3            m, m, rad  world    -
    ==============  ===========  =========  =======  ===========

    The picture's top is the robot's front, its right the robot's left (`omni_optics`).

    Source: Zhang 2014, 2.2.4.1 and Figures 2.7 to 2.9.

    Args:
        camera: Optics and size of the picture.
        sensor: Quality of the picture, losses, seed.
        surroundings: Floor and walls.
        shells: Of the M other robots, in the order of their positions.
        own_shell: Of the robot that carries the camera, seen from above; or None.
        period: Between pictures [s].

    Raises:
        InvalidInput: The period is not positive, or the own shell reaches up to the mirror.
    """

    def __init__(
        self,
        camera: OmniCamera,
        sensor: Sensor,
        surroundings: Surroundings,
        shells: Sequence[Shell],
        *,
        own_shell: Shell | None = None,
        period: float = 0.1,
    ):
        super().__init__()
        require_positive("period", period)
        lowest = camera.pinhole_height + camera.mirror_distance
        require(
            own_shell is None or own_shell.top < lowest,
            "own_shell",
            f"stay below the mirror, {lowest:g} m",
            own_shell,
        )
        self._camera, self._sensor, self._surroundings = camera, sensor, surroundings
        self._rays = make_ray_table(camera)
        self._others = list(shells)
        self._own = [] if own_shell is None else [own_shell]
        self.period = float(period)
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._positions = self.DeclareVectorInputPort("shell_position", 2 * len(shells))
        # A picture is drawn from what is held: the state is small, and its picture is cached.
        # Abstract, because Drake forgets what it has cached of discrete states whenever any in
        # the diagram changes, many times for each picture.
        nothing = Exposure(-1, 0.0, False, np.zeros(3), np.zeros(2 * len(shells)))
        self._exposure = self.DeclareAbstractState(AbstractValue.Make(nothing))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._sample)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._sample)
        state = {self.abstract_state_ticket(self._exposure)}
        self.DeclareAbstractOutputPort(
            "image",
            lambda: AbstractValue.Make(ImageRgba8U(camera.width, camera.height)),
            self._calc_image,
            prerequisites_of_calc=state,
        )
        self.DeclareVectorOutputPort("frame", 3, self._calc_frame, prerequisites_of_calc=state)
        self.DeclareVectorOutputPort(
            "exposure_pose", 3, self._calc_exposure_pose, prerequisites_of_calc=state
        )

    def _held(self, context) -> Exposure:
        return context.get_abstract_state(self._exposure).get_value()

    def _sample(self, context, state):
        tick = round(context.get_time() / self.period)
        if is_dropped(self._sensor, tick):
            exposure = replace(self._held(context), arrived=False)
        else:
            pose, positions = read(self._pose, context), read(self._positions, context)
            exposure = Exposure(tick, context.get_time(), True, pose, positions)
        state.get_mutable_abstract_state(self._exposure).set_value(exposure)

    def _calc_image(self, context, output):
        image = output.get_mutable_value().mutable_data
        held = self._held(context)
        if held.number < 0:
            image[:] = [0, 0, 0, 255]
            return
        light = render(
            self._camera,
            self._rays,
            self._surroundings,
            held.pose,
            [*self._others, *self._own],
            np.vstack([held.positions.reshape(-1, 2), *[held.pose[:2] for _ in self._own]]),
        )
        image[:] = expose(self._sensor, light, held.number)

    def _calc_frame(self, context, output):
        held = self._held(context)
        output.set_value([held.number, held.time, held.arrived])

    def _calc_exposure_pose(self, context, output):
        output.set_value(self._held(context).pose)

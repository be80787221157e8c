"""Pictures of a camera, from the device into a diagram."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ...systems.drake_types import AbstractValue, state_vector
from ...systems.numerics.errors import require_positive
from ...systems.numerics.station.freshness import freshness
from .frame_source import FrameSource


@dataclass(frozen=True, eq=False)
class _Held:
    picture: np.ndarray


class CameraPort(LeafSystem):
    """Samples a camera at its ticks, and says how old its picture is and whether it is still good.

    The picture is of one black pixel before the first has come.

    .. pydrake_system::

        name: CameraPort
        input_ports: []
        output_ports:
        - image
        - valid
        - age
        - stamp

    =====  ===========  ====  =======  ===========
    port   size         unit  frame    feedthrough
    =====  ===========  ====  =======  ===========
    image  ImageRgba8U  -     picture  -
    valid  1            -     -        -
    age    1            s     -        -
    stamp  1            s     -        -
    =====  ===========  ====  =======  ===========

    `stamp` is the diagram's time at which the picture came, minus infinity if none did.

    Source: the cameras of Zhang 2014, 2.2.4.1 and 2.3.4.

    Args:
        source: The camera.
        period: Between ticks [s].
        stale_after: Age up to which a picture is valid [s].
        clock: The clock of the source's stamps [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(
        self,
        source: FrameSource,
        *,
        period: float,
        stale_after: float,
        clock: Callable[[], float] = time.monotonic,
    ):
        super().__init__()
        require_positive("period", period)
        require_positive("stale_after", stale_after)
        self._source, self._clock, self._limit = source, clock, float(stale_after)
        black = np.zeros((1, 1, 4), dtype=np.uint8)
        black[..., 3] = 255
        self._picture = self.DeclareAbstractState(AbstractValue.Make(_Held(black)))
        # valid, age, stamp.
        self._times = self.DeclareDiscreteState(state_vector(np.array([0.0, np.inf, -np.inf])))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._sample)
        self.DeclareAbstractOutputPort(
            "image",
            lambda: AbstractValue.Make(ImageRgba8U(1, 1)),
            self._calc_image,
            prerequisites_of_calc={self.abstract_state_ticket(self._picture)},
        )
        for k, name in enumerate(("valid", "age", "stamp")):
            self.DeclareVectorOutputPort(
                name, 1, self._time_calc(k), {self.discrete_state_ticket(self._times)}
            )

    def _time_calc(self, k: int):
        return lambda context, output: output.set_value(
            context.get_discrete_state(self._times).value()[k : k + 1]
        )

    def _sample(self, context, state):
        frame = self._source.read()
        if frame is None:
            return
        valid, ages = freshness(self._clock(), np.array([frame.stamp]), self._limit)
        state.get_mutable_abstract_state(self._picture).set_value(_Held(frame.picture))
        state.get_mutable_discrete_state(self._times).set_value(
            np.array([valid[0], ages[0], context.get_time() - ages[0]])
        )

    def _calc_image(self, context, output):
        picture = context.get_abstract_state(self._picture).get_value().picture
        image = ImageRgba8U(picture.shape[1], picture.shape[0])
        data: Any = image.mutable_data
        data[:] = picture
        output.set_value(image)

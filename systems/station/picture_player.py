"""Recorded pictures of a port, in place of the camera that took them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ..drake_types import AbstractValue, state_vector
from ..numerics.errors import require_positive


class PicturePlayer(LeafSystem):
    """Shows each picture from the tick at which it was new.

    .. pydrake_system::

        name: PicturePlayer
        input_ports: []
        output_ports:
        - image

    =====  ===========  ====  =======  ===========
    port   size         unit  frame    feedthrough
    =====  ===========  ====  =======  ===========
    image  ImageRgba8U  -     picture  -
    =====  ===========  ====  =======  ===========

    Source: ours.

    Args:
        ticks: At which each picture was new, rising, shape (T,).
        picture: Gives the picture of a number, shape (height, width, 4), uint8.
        period: Between ticks [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(
        self, ticks: Sequence[int], picture: Callable[[int], np.ndarray], *, period: float
    ):
        super().__init__()
        require_positive("period", period)
        self._ticks, self._picture, self._period = list(ticks), picture, float(period)
        self._shown = self.DeclareDiscreteState(state_vector(np.array([-1.0])))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareAbstractOutputPort(
            "image",
            lambda: AbstractValue.Make(ImageRgba8U(1, 1)),
            self._calc_image,
            prerequisites_of_calc={self.discrete_state_ticket(self._shown)},
        )

    def _advance(self, context, discrete_state):
        tick = round(context.get_time() / self._period)
        number = int(np.searchsorted(self._ticks, tick, side="right")) - 1
        discrete_state.set_value(self._shown, np.array([float(number)]))

    def _calc_image(self, context, output):
        number = int(context.get_discrete_state(self._shown).value()[0])
        if number < 0:
            output.set_value(ImageRgba8U(1, 1))
            return
        picture = self._picture(number)
        image = ImageRgba8U(picture.shape[1], picture.shape[0])
        data: Any = image.mutable_data
        data[:] = picture
        output.set_value(image)

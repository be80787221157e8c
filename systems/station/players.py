"""Recorded samples and pictures of a port, in place of the device that gave them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ..drake_types import AbstractValue, state_vector
from ..numerics.errors import require, require_positive


class SamplePlayer(LeafSystem):
    """Shows one sample after another, one per tick, and the last one ever after.

    Like the receivers, it changes in the update at the tick: whoever reads it at the moment of
    the tick itself still sees the sample before, as when the samples were recorded.

    .. pydrake_system::

        name: SamplePlayer
        input_ports: []
        output_ports:
        - sample

    ======  ====  ====  =====  ===========
    port    size  unit  frame  feedthrough
    ======  ====  ====  =====  ===========
    sample  n     any   any    -
    ======  ====  ====  =====  ===========

    Source: ours.

    Args:
        samples: One row for each tick, shape (T, n).
        initial: What is shown before the first tick, shape (n,).
        period: Between ticks [s].

    Raises:
        InvalidInput: There are no samples, or the period is not positive.
    """

    def __init__(self, samples: ArrayLike, initial: ArrayLike, *, period: float):
        super().__init__()
        self._samples = np.asarray(samples, dtype=float)
        shape = self._samples.shape
        require(len(shape) == 2 and shape[0] > 0, "samples", "have shape (T, n), T > 0", shape)
        require_positive("period", period)
        self._period = float(period)
        self._shown = self.DeclareDiscreteState(state_vector(np.asarray(initial, dtype=float)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareStateOutputPort("sample", self._shown)

    def _advance(self, context, discrete_state):
        tick = round(context.get_time() / self._period)
        row = self._samples[min(tick, len(self._samples) - 1)]
        discrete_state.set_value(self._shown, row)


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

"""A channel of the simulated laboratory: motion capture, radio, sensors."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require
from ..numerics.station.channel import Channel, Flight, empty_flight, received, send


class ImperfectChannel(LeafSystem):
    """Delays, loses and rounds samples of what comes in, each member's on their own.

    Samples are taken at the channel's period. `received` is the newest that has arrived of each
    member, `stamp` when it was taken: minus infinity before the first. A sample that arrives at
    once is received from the moment after its tick on.

    .. pydrake_system::

        name: ImperfectChannel
        input_ports:
        - sent
        output_ports:
        - received
        - stamp

    ========  =======  ====  =====  ===========
    port      size     unit  frame  feedthrough
    ========  =======  ====  =====  ===========
    sent      N width  any   any    -
    received  N width  any   any    -
    stamp     N        s     -      -
    ========  =======  ====  =====  ===========

    Source: the radio and the motion capture of Zhang 2014, 2.2.8; the model is ours.

    Args:
        channel: How bad it is.
        initial: What is received before anything has come, shape (N, width).

    Raises:
        InvalidInput: `initial` has another shape.
    """

    def __init__(self, channel: Channel, initial: ArrayLike):
        super().__init__()
        values = np.asarray(initial, dtype=float)
        require(values.ndim == 2 and values.size > 0, "initial", "be (N, width)", values.shape)
        self._channel = channel
        flight = empty_flight(channel, values)
        self._shapes = [part.shape for part in flight]
        self._sent = self.DeclareVectorInputPort("sent", values.size)
        self._parts = [self.DeclareDiscreteState(state_vector(part.ravel())) for part in flight]
        self.DeclarePeriodicDiscreteUpdateEvent(channel.period, 0.0, self._take)
        depends = {self.all_state_ticket(), self.time_ticket()}
        self.DeclareVectorOutputPort("received", values.size, self._calc_received, depends)
        self.DeclareVectorOutputPort("stamp", len(values), self._calc_stamp, depends)

    def _flight(self, context) -> Flight:
        parts = (context.get_discrete_state(part).value() for part in self._parts)
        return Flight(
            *(part.reshape(shape) for part, shape in zip(parts, self._shapes, strict=True))
        )

    def _take(self, context, discrete_state):
        tick = round(context.get_time() / self._channel.period)
        values = read(self._sent, context).reshape(self._shapes[3])
        flight = send(self._channel, self._flight(context), tick, values)
        for part, value in zip(self._parts, flight, strict=True):
            discrete_state.set_value(part, value.ravel())

    def _calc_received(self, context, output):
        output.set_value(received(self._flight(context), context.get_time())[0].ravel())

    def _calc_stamp(self, context, output):
        output.set_value(received(self._flight(context), context.get_time())[1])

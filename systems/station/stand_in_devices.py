"""What stands in for the devices of a laboratory: simulations of them, and recordings.

Motion capture, radio and sensors with their faults, encoders, robots whose radio falls silent; and
recorded samples and pictures of a port.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ..drake_parts import AbstractValue, NumericParameters, read, state_vector
from ..numerics.errors import require, require_positive, require_whole
from ..numerics.station.channel import Channel, Flight, empty_flight, freshness, received, send
from ..numerics.station.motion_checks import Chassis, wheel_ways


class ImperfectChannel(LeafSystem):
    """Delays, loses and rounds samples of what comes in, separately for each member.

    Samples are taken at the channel's period. `received` is the newest sample of each member that
    has arrived, `stamp` when it was taken: minus infinity before the first. A sample that arrives
    at once is received from just after its tick on.

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


class SampledReceiver(LeafSystem):
    """Samples what a channel has received, and says how old it is and whether it is still good.

    .. pydrake_system::

        name: SampledReceiver
        input_ports:
        - received
        - arrival_stamp
        output_ports:
        - value
        - valid
        - age
        - stamp

    =============  =======  ====  =====  ===========
    port           size     unit  frame  feedthrough
    =============  =======  ====  =====  ===========
    received       N width  any   any    -
    arrival_stamp  N        s     -      -
    value          N width  any   any    -
    valid          N        -     -      -
    age            N        s     -      -
    stamp          N        s     -      -
    =============  =======  ====  =====  ===========

    `arrival_stamp` is when each received sample was taken, minus infinity if none has come; `stamp`
    is the same, held. `valid` is 1 for a member whose sample is not older than the limit, else 0.

    Source: ours.

    Args:
        initial: Values before the first tick, shape (N, width).
        period: Between ticks [s].
        stale_after: Age up to which a sample is valid [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, initial: ArrayLike, *, period: float, stale_after: float):
        super().__init__()
        require_positive("period", period)
        require_positive("stale_after", stale_after)
        values = np.asarray(initial, dtype=float)
        count = len(values)
        self._limit = float(stale_after)
        self._received = self.DeclareVectorInputPort("received", values.size)
        self._arrival = self.DeclareVectorInputPort("arrival_stamp", count)
        self._value = self.DeclareDiscreteState(state_vector(values.ravel()))
        self._valid = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self._age = self.DeclareDiscreteState(state_vector(np.full(count, np.inf)))
        self._stamp = self.DeclareDiscreteState(state_vector(np.full(count, -np.inf)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        self.DeclareStateOutputPort("value", self._value)
        self.DeclareStateOutputPort("valid", self._valid)
        self.DeclareStateOutputPort("age", self._age)
        self.DeclareStateOutputPort("stamp", self._stamp)

    def _sample(self, context, discrete_state):
        stamps = read(self._arrival, context)
        valid, ages = freshness(context.get_time(), stamps, self._limit)
        discrete_state.set_value(self._value, read(self._received, context))
        discrete_state.set_value(self._valid, valid)
        discrete_state.set_value(self._age, ages)
        discrete_state.set_value(self._stamp, stamps)


class WheelEncoders(LeafSystem):
    """Counts how far the wheels of robots have turned.

    .. pydrake_system::

        name: WheelEncoders
        input_ports:
        - pose
        output_ports:
        - counts

    ======  ====  =========  =====  ===========
    port    size  unit       frame  feedthrough
    ======  ====  =========  =====  ===========
    pose    3 N   m, m, rad  world  -
    counts  2 N   -          -      -
    ======  ====  =========  =====  ===========

    Left and right wheel of each robot; ahead counts are positive.

    Source: the robots of Zhang 2014, 2.2.8; the model is ours.

    Args:
        chassis: Wheels of the robots.
        starts: Poses at which counting begins, shape (N, 3).
        period: Between looks at the poses [s].

    Raises:
        InvalidInput: The starts have another shape, or the period is not positive.
    """

    def __init__(self, chassis: Chassis, starts: ArrayLike, *, period: float):
        super().__init__()
        require_positive("period", period)
        poses = np.array(starts, dtype=float)
        require(poses.ndim == 2 and poses.shape[1] == 3, "starts", "be (N, 3)", poses.shape)
        self._chassis = chassis
        self._pose = self.DeclareVectorInputPort("pose", poses.size)
        self._before = self.DeclareDiscreteState(state_vector(poses.ravel()))
        self._ways = self.DeclareDiscreteState(state_vector(np.zeros(2 * len(poses))))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._turn)
        depends = {self.discrete_state_ticket(self._ways)}
        self.DeclareVectorOutputPort("counts", 2 * len(poses), self._calc_counts, depends)

    def _turn(self, context, discrete_state):
        before = context.get_discrete_state(self._before).value().reshape(-1, 3)
        poses = read(self._pose, context).reshape(-1, 3)
        ways = context.get_discrete_state(self._ways).value()
        step = wheel_ways(self._chassis, before, poses).ravel()
        discrete_state.set_value(self._ways, ways + step)
        discrete_state.set_value(self._before, poses.ravel())

    def _calc_counts(self, context, output):
        ways = context.get_discrete_state(self._ways).value()
        output.set_value(np.floor(self._chassis.counts_per_metre * ways))


class CommandTimeout(LeafSystem):
    """Passes on commands while they are fresh, and zero to a robot that has not heard for long.

    .. pydrake_system::

        name: CommandTimeout
        input_ports:
        - command
        - stamp
        output_ports:
        - obeyed_command

    ==============  ====  ==========  =====  ===========
    port            size  unit        frame  feedthrough
    ==============  ====  ==========  =====  ===========
    command         2 N   m/s, rad/s  robot  -
    stamp           N     s           -      -
    obeyed_command  2 N   m/s, rad/s  robot  all
    ==============  ====  ==========  =====  ===========

    Numeric parameters: `limit`.

    Source: ours; what the firmware does on loss of the heartbeat.

    Args:
        count: Number of robots N.
        limit: How old the last command may be [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, count: int, *, limit: float):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("limit", limit)
        self.parameters = NumericParameters(self, limit=limit)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._stamp = self.DeclareVectorInputPort("stamp", count)
        self.DeclareVectorOutputPort("obeyed_command", 2 * count, self._calc_obeyed_command)

    def _calc_obeyed_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2)
        limit = self.parameters(context).limit
        valid, _ = freshness(context.get_time(), read(self._stamp, context), limit)
        output.set_value(np.where(valid[:, None] > 0.5, commands, 0.0).ravel())


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

"""Systems of the common robots: infrared sensors, wandering, and collision avoidance."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import NumericParameters, read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive, require_whole
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.world import World
from ..numerics.social.routes.infrared import InfraredRing, infrared_ranges
from ..numerics.social.routes.motion import WanderingLaw, guarded_commands, wander


class InfraredSensors(LeafSystem):
    """Tells each robot how near the nearest wall or robot is in each of its cones.

    Ranges are from the robot's rim, and at most the sensors' reach; they come robot by robot, each
    robot's from left to right.

    .. pydrake_system::

        name: InfraredSensors
        input_ports:
        - pose
        output_ports:
        - infrared

    ========  =======  =========  =====  ===========
    port      size     unit       frame  feedthrough
    ========  =======  =========  =====  ===========
    pose      3 N      m, m, rad  world  -
    infrared  N ring   m          robot  all
    ========  =======  =========  =====  ===========

    Source: Zhang 2014, 2.3.4, Figure 2.31.

    Args:
        world: Its walls.
        count: Number of robots N.
        radius: Of each [m].
        ring: Where the sensors look.

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, world: World, *, count: int, radius: float, ring: InfraredRing):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("radius", radius)
        self._edges = build_edge_index(world).edges
        self._radius, self._ring = float(radius), ring
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self.DeclareVectorOutputPort("infrared", count * ring.count, self._calc_infrared)

    def get_pose_input_port(self):
        """Poses, size 3 N [m], [m], [rad]."""
        return self._pose

    def get_infrared_output_port(self):
        """Ranges, size N times the sensors of a ring [m]."""
        return self.GetOutputPort("infrared")

    def _calc_infrared(self, context, output):
        poses = np.ascontiguousarray(read(self._pose, context).reshape(-1, 3))
        ranges = infrared_ranges(self._edges, poses, self._radius, self._ring)
        output.set_value(ranges.ravel())


class Wanderers(LeafSystem):
    """Robots that go straight on until something is near, then turn by a random angle.

    The angles are a function of the seed and of the number of the period alone, so that a run
    repeats exactly and can be resumed from any context.

    .. pydrake_system::

        name: Wanderers
        input_ports:
        - infrared
        output_ports:
        - command

    ========  =======  ==========  =====  ===========
    port      size     unit        frame  feedthrough
    ========  =======  ==========  =====  ===========
    infrared  N ring   m           robot  -
    command   2 N      m/s, rad/s  robot  all
    ========  =======  ==========  =====  ===========

    Source: Zhang 2014, 2.3.4.3.

    Args:
        count: Number of robots N.
        law: What they do about what they feel.
        ring: Where the sensors look.
        period: For how long a command is held [s].
        seed: Of the angles.

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self, count: int, *, law: WanderingLaw, ring: InfraredRing, period: float, seed: int = 0
    ):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("period", period)
        require(seed >= 0, "seed", "be zero or positive", seed)
        self._count, self._law, self._ring = count, law, ring
        self._period, self._seed = float(period), seed
        self._infrared = self.DeclareVectorInputPort("infrared", count * ring.count)
        # The number of the period, then what each robot has left to turn.
        self._step = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self._turns = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareVectorOutputPort("command", 2 * count, self._calc_command)

    def get_infrared_input_port(self):
        """What the sensors say [m]."""
        return self._infrared

    def get_command_output_port(self):
        """Speed and turn rate of each, size 2 N [m/s], [rad/s]."""
        return self.GetOutputPort("command")

    def _wander(self, context) -> tuple[np.ndarray, np.ndarray]:
        step = int(context.get_discrete_state(self._step).value()[0])
        generator = np.random.Generator(np.random.Philox(key=[self._seed, step]))
        return wander(
            self._law,
            self._ring,
            np.array(context.get_discrete_state(self._turns).value()),
            read(self._infrared, context).reshape(self._count, -1),
            generator.random(self._count),
            self._period,
        )

    def _advance(self, context, discrete_state):
        step = context.get_discrete_state(self._step).value()[0]
        discrete_state.set_value(self._turns, self._wander(context)[0])
        discrete_state.set_value(self._step, np.array([step + 1.0]))

    def _calc_command(self, context, output):
        output.set_value(self._wander(context)[1].ravel())


class CrowdGuard(LeafSystem):
    """Slows robots so that no two of them touch, whatever their commands.

    In a period each may close half of the gap that its infrared sensors measure. Robots drive
    forwards only, and the ring must cover their whole front, also after the turn of a period; then,
    if all robots are guarded, the gaps between them stay above the margin.

    .. pydrake_system::

        name: CrowdGuard
        input_ports:
        - command
        - infrared
        output_ports:
        - safe_command

    ============  =======  ==========  =====  ===========
    port          size     unit        frame  feedthrough
    ============  =======  ==========  =====  ===========
    command       2 N      m/s, rad/s  robot  -
    infrared      N ring   m           robot  -
    safe_command  2 N      m/s, rad/s  robot  all
    ============  =======  ==========  =====  ===========

    Numeric parameters: `margin`, `top_turn_rate`.

    Source: Zhang 2014, 2.3.4.3 (collision avoidance on infrared); the rule is ours.

    Args:
        count: Number of robots N.
        ring: Where the sensors look.
        margin: Gap left between robots [m].
        period: For how long commands are held [s].
        top_turn_rate: Of the robots [rad/s].

    Raises:
        InvalidInput: A number is out of its range, or the ring leaves a part of the front out.
    """

    def __init__(
        self,
        *,
        count: int,
        ring: InfraredRing,
        margin: float,
        period: float,
        top_turn_rate: float,
    ):
        super().__init__()
        require_whole("count", count, 1)
        require_non_negative("margin", margin)
        require_positive("period", period)
        require_positive("top_turn_rate", top_turn_rate)
        needed = 0.5 * np.pi + 0.5 * period * top_turn_rate
        require(
            ring.coverage >= needed,
            "ring",
            f"cover {needed:.4g} rad on either side",
            f"{ring.coverage:.4g}",
        )
        self._ring, self._period = ring, float(period)
        self.parameters = NumericParameters(self, margin=margin, top_turn_rate=top_turn_rate)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        self._infrared = self.DeclareVectorInputPort("infrared", count * ring.count)
        self.DeclareVectorOutputPort("safe_command", 2 * count, self._calc_safe_command)

    def get_command_input_port(self):
        """What the robots want, size 2 N [m/s], [rad/s]."""
        return self._command

    def get_infrared_input_port(self):
        """What their sensors say [m]."""
        return self._infrared

    def get_safe_command_output_port(self):
        """What they may do, size 2 N [m/s], [rad/s]."""
        return self.GetOutputPort("safe_command")

    def _calc_safe_command(self, context, output):
        commands = read(self._command, context).reshape(-1, 2).copy()
        margin, limit = self.parameters(context)
        commands[:, 1] = np.clip(commands[:, 1], -limit, limit)
        safe = guarded_commands(
            commands,
            np.ascontiguousarray(read(self._infrared, context).reshape(len(commands), -1)),
            np.array(self._ring.bearings),
            0.5 * self._ring.cone,
            margin,
            self._period,
        )
        output.set_value(safe.ravel())

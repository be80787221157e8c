"""The common agents' cameras, and the posting of their pictures to albums."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.framework import EventStatus, LeafSystem

from ..drake_parts import AbstractValue, read
from ..numerics.errors import require_non_negative, require_positive
from ..numerics.social.landmarks.maze import Maze
from ..numerics.social.network.interface import Picture, SocialNetwork
from ..numerics.social.recognition.picture_files import encode_picture
from ..numerics.vision.sensor import Sensor, expose, is_dropped
from .maze_renderer import MazeRenderer


@dataclass(frozen=True, eq=False)
class Moment:
    """Poses at one time, from which pictures are drawn.

    Attributes:
        number: Number of the moment, or -1 before the first.
        time: Time [s].
        agents: Poses of the common agents, shape (n, 3) [m], [m], [rad].
        evader, pursuer: Poses, shape (3,).
    """

    number: int
    time: float
    agents: np.ndarray
    evader: np.ndarray
    pursuer: np.ndarray


class ForwardCameras(LeafSystem):
    """Takes a picture from each common agent's pose in every period.

    At each tick all poses are held; `pictures` is what the agents see then, drawn by Drake's
    `RgbdSensor` when it is first asked for: walls, landmarks, and the other robots, the evader with
    its markers among them. Lens and sensor blur them and add noise. A picture that is lost is left
    out.

    .. pydrake_system::

        name: ForwardCameras
        input_ports:
        - agent_pose
        - evader_pose
        - pursuer_pose
        output_ports:
        - pictures

    ============  ==========================  =========  =====  ===========
    port          size                        unit       frame  feedthrough
    ============  ==========================  =========  =====  ===========
    agent_pose    3 n                         m, m, rad  world  -
    evader_pose   3                           m, m, rad  world  -
    pursuer_pose  3                           m, m, rad  world  -
    pictures      abstract: tuple of Picture  -          -      -
    ============  ==========================  =========  =====  ===========

    Source: Zhang 2014, 2.3.1 and 2.3.4.

    Args:
        maze: Its walls, landmarks, marker and cameras.
        agents: How many common agents, n.
        sensor: Quality of the pictures, losses, seed.
        period: Between pictures [s].

    Raises:
        InvalidInput: A number is out of its range.
        SightfieldError: The system lacks the graphics library.
    """

    def __init__(
        self, maze: Maze, agents: int, *, sensor: Sensor | None = None, period: float = 1.0
    ):
        super().__init__()
        require_positive("period", period)
        # The renderer is not state: each picture depends only on its arguments.
        self._maze, self._count = maze, agents
        self._renderer: MazeRenderer | None = None
        # Made now, so that a missing graphics library shows before a simulation starts.
        self._open()
        self._sensor = Sensor() if sensor is None else sensor
        self.period = float(period)
        self._agents = self.DeclareVectorInputPort("agent_pose", 3 * agents)
        self._evader = self.DeclareVectorInputPort("evader_pose", 3)
        self._pursuer = self.DeclareVectorInputPort("pursuer_pose", 3)
        nothing = Moment(-1, 0.0, np.zeros((agents, 3)), np.zeros(3), np.zeros(3))
        self._moment = self.DeclareAbstractState(AbstractValue.Make(nothing))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._hold)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._hold)
        self.DeclareAbstractOutputPort(
            "pictures",
            lambda: AbstractValue.Make(()),
            self._calc_pictures,
            prerequisites_of_calc={self.abstract_state_ticket(self._moment)},
        )

    def release(self) -> None:
        """Give back the renderer's memory, some 130 MB; the next picture makes another.

        Drake keeps systems written in Python until the process ends.
        """
        self._renderer = None

    def _open(self) -> MazeRenderer:
        if self._renderer is None:
            self._renderer = MazeRenderer(self._maze, common_agents=self._count)
        return self._renderer

    def _hold(self, context, state):
        moment = Moment(
            round(context.get_time() / self.period),
            context.get_time(),
            read(self._agents, context).reshape(-1, 3),
            read(self._evader, context),
            read(self._pursuer, context),
        )
        state.get_mutable_abstract_state(self._moment).set_value(moment)

    def _calc_pictures(self, context, output):
        moment: Moment = context.get_abstract_state(self._moment).get_value()
        agents = range(self._count) if moment.number >= 0 else ()
        taken = (self._take(moment, agent) for agent in agents)
        output.set_value(tuple(each for each in taken if each is not None))

    def _take(self, moment: Moment, agent: int) -> Picture | None:
        # A unique frame number gives each picture of the run its own noise.
        frame = moment.number * self._count + agent
        if is_dropped(self._sensor, frame):
            return None
        seen = self._open().render(agent, moment.agents, moment.evader, moment.pursuer)
        pixels = expose(self._sensor, seen / np.float32(255), frame)
        name = f"agent-{agent}-picture-{moment.number}"
        return Picture(id=name, agent=agent, time=moment.time, data=encode_picture(pixels))


class PicturePoster(LeafSystem):
    """Posts each common agent's newest picture to its album, once each period.

    .. pydrake_system::

        name: PicturePoster
        input_ports:
        - pictures
        output_ports: []

    ========  ==========================  ====  =====
    port      size                        unit  frame
    ========  ==========================  ====  =====
    pictures  abstract: tuple of Picture  -     -
    ========  ==========================  ====  =====

    The network is outside the simulation, as Meshcat is.

    Source: Zhang 2014, 2.3.1 ("common agents will post the pictures on the social website").

    Args:
        network: Where to.
        period: Between pictures [s].
        offset: Of the first post: not before the first picture is taken [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(self, network: SocialNetwork, *, period: float, offset: float):
        super().__init__()
        require_positive("period", period)
        require_non_negative("offset", offset)
        self._network = network
        self._pictures = self.DeclareAbstractInputPort("pictures", AbstractValue.Make(()))
        self.DeclarePeriodicPublishEvent(period, offset, self._post)

    def get_pictures_input_port(self):
        """The newest picture of each agent."""
        return self._pictures

    def _post(self, context) -> EventStatus:
        pictures: Any = self._pictures.Eval(context)
        for picture in pictures:
            self._network.post(picture.agent, picture)
        return EventStatus.Succeeded()

"""Whom to ask: the expected information of each agent's pictures."""

from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import AbstractValue, read, state_vector
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.social.localisation.location import Reading
from ..numerics.social.network.information import estimated_acceptance, interest
from ..numerics.social.routes.outlook import Outlook, belief, expected_view


class AgentInterest(LeafSystem):
    """Outputs the value of asking each agent: probability of acceptance times information.

    The evader is believed to be where it was located, with an uncertainty that grows with time. If
    an agent's pictures have been read, its pose then is known; the older that is, the less it says
    about what the agent sees now. Of other agents nothing is known.

    .. pydrake_system::

        name: AgentInterest
        input_ports:
        - tallies
        - evader_position
        - evader_covariance
        - readings
        output_ports:
        - interest

    =================  ==========================  ====  =====  ================
    port               size                        unit  frame  feedthrough
    =================  ==========================  ====  =====  ================
    tallies            2 n                         -     -      -
    evader_position    2                           m     world  -
    evader_covariance  4                           m^2   world  -
    readings           abstract: tuple of Reading  -     -      -
    interest           n                           nat   -      all but readings
    =================  ==========================  ====  =====  ================

    `tallies` is `NetworkEvolution`'s, the others but `interest` are `EvaderLocator`'s. Numeric
    parameters: `forgetting`.

    Source: ours (Zhang 2014, 4.4, asks for it).

    Args:
        outlook: Cells of the maze, and how far cameras see.
        agents: Number of agents n.
        patience: T_wait, further chances that an asked agent has after the first.
        forgetting: Time constant with which knowledge of a camera's pose fades [s].
        period: Between looks at the readings [s].
        offset: Of the first look [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        outlook: Outlook,
        *,
        agents: int,
        patience: int,
        forgetting: float = 10.0,
        period: float = 1.0,
        offset: float = 0.0,
    ):
        super().__init__()
        require(agents > 0, "agents", "be positive", agents)
        require(patience >= 0, "patience", "be zero or positive", patience)
        require_positive("forgetting", forgetting)
        require_positive("period", period)
        require_non_negative("offset", offset)
        self._outlook, self._patience = outlook, patience
        self.parameters = NumericParameters(self, forgetting=forgetting)
        self._tallies = self.DeclareVectorInputPort("tallies", 2 * agents)
        self._position = self.DeclareVectorInputPort("evader_position", 2)
        self._covariance = self.DeclareVectorInputPort("evader_covariance", 4)
        self._readings = self.DeclareAbstractInputPort("readings", AbstractValue.Make(()))
        # For each agent: time at which its pose was last known, or -1, and that pose.
        nothing = np.tile([-1.0, 0.0, 0.0, 0.0], agents)
        self._cameras = self.DeclareDiscreteState(state_vector(nothing))
        self.DeclarePeriodicDiscreteUpdateEvent(period, offset, self._look)
        # All but the readings, which go into what is known of the cameras.
        sources = {
            self._tallies.ticket(),
            self._position.ticket(),
            self._covariance.ticket(),
            self.discrete_state_ticket(self._cameras),
            self.time_ticket(),
            self.all_parameters_ticket(),
        }
        self.DeclareVectorOutputPort("interest", agents, self._calc_interest, sources)

    def get_interest_output_port(self):
        """Of asking each agent, size n [nat]."""
        return self.GetOutputPort("interest")

    def _look(self, context, discrete_state):
        cameras = np.array(context.get_discrete_state(self._cameras).value()).reshape(-1, 4)
        readings: tuple[Reading, ...] | Any = self._readings.Eval(context)
        for each in readings:
            camera, then = each.location.camera, each.picture.time
            if camera is not None and then > cameras[each.picture.agent, 0]:
                cameras[each.picture.agent] = then, *camera.pose
        discrete_state.set_value(self._cameras, cameras.ravel())

    def _calc_interest(self, context, output):
        cameras = context.get_discrete_state(self._cameras).value().reshape(-1, 4)
        ages = np.where(cameras[:, 0] >= 0, context.get_time() - cameras[:, 0], np.inf)
        outlook, forgetting = self._outlook, self.parameters(context).forgetting
        views = np.array(
            [
                expected_view(outlook, camera[1:], float(age), forgetting)
                for camera, age in zip(cameras, ages, strict=True)
            ]
        )
        covariance = read(self._covariance, context).reshape(2, 2)
        believed = belief(outlook, read(self._position, context), covariance)
        accepting = estimated_acceptance(read(self._tallies, context).reshape(-1, 2))
        output.set_value(interest(believed, views, accepting, self._patience))

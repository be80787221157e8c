"""The pursuer's use of the social network: whom to ask, and reading friends' albums."""

from typing import Any

import numpy as np
from pydrake.systems.framework import EventStatus, LeafSystem

from ..drake_parts import AbstractValue, NumericParameters, read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive, require_whole
from ..numerics.social.localisation.location import Reading
from ..numerics.social.network.evolution import (
    FRIEND,
    Acquaintances,
    EvolutionLimits,
    estimated_acceptance,
    evolve,
    interest,
    update_tallies,
    with_friends,
)
from ..numerics.social.network.interface import Scan, SocialNetwork, scan
from ..numerics.social.routes.outlook import Outlook, belief, expected_view


class NetworkEvolution(LeafSystem):
    """Makes friends and keeps them: Algorithm 2, one iteration each period.

    An iteration asks at most N_req - |A| new agents while |F| + |A| < N_f, lets the network go on,
    and reads its answers (`systems/numerics/social/network/evolution.py`).

    .. pydrake_system::

        name: NetworkEvolution
        input_ports:
        - interest
        output_ports:
        - connected
        - waiting
        - counters
        - tallies
        - requests_sent
        - iteration

    =============  ====  ====  =====  ===========
    port           size  unit  frame  feedthrough
    =============  ====  ====  =====  ===========
    interest       n     any   -      -
    connected      n     -     -      -
    waiting        n     -     -      -
    counters       n     -     -      -
    tallies        2 n   -     -      -
    requests_sent  1     -     -      -
    iteration      1     -     -      -
    =============  ====  ====  =====  ===========

    `interest` may be left open: then new agents are asked in turn, else those of greatest interest
    first. `connected` is 1 for friends, `waiting` for agents whose answer is awaited; `counters` is
    the number of iterations in which an answer was awaited and did not come, 0 for agents whose
    answer is not awaited. `tallies` has two numbers for each agent: iterations
    in which it was asked and accepted, and in which it was asked and did not. `iteration` is the
    number of iterations done.

    The network is outside the simulation, as Meshcat is. It is started when the simulator is
    initialised; from there a run with a network in memory repeats exactly.

    Source: Zhang 2014, Algorithm 2.

    Args:
        network: Whose agents are 0 to n - 1.
        limits: N_req, T_wait and N_f.
        period: Between iterations [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(
        self, network: SocialNetwork, limits: EvolutionLimits | None = None, *, period: float = 1.0
    ):
        super().__init__()
        require_positive("period", period)
        self._network, self._limits = network, limits or EvolutionLimits()
        count = self._count = len(network.agents())
        start = with_friends(count, ())
        self._interest = self.DeclareVectorInputPort("interest", count)
        self._status = self.DeclareDiscreteState(state_vector(np.array(start.status, dtype=float)))
        self._queue = self.DeclareDiscreteState(state_vector(np.array(start.queue, dtype=float)))
        self._tallies = self.DeclareDiscreteState(state_vector(np.zeros(2 * count)))
        self._sent = self.DeclareDiscreteState(1)
        self._iteration = self.DeclareDiscreteState(1)
        self.DeclareInitializationDiscreteUpdateEvent(self._begin)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._iterate)
        state = {self.xd_ticket()}
        for name, calc in (
            ("connected", self._calc_connected),
            ("waiting", self._calc_waiting),
            ("counters", self._calc_counters),
        ):
            self.DeclareVectorOutputPort(name, count, calc, prerequisites_of_calc=state)
        self.DeclareStateOutputPort("tallies", self._tallies)
        self.DeclareStateOutputPort("requests_sent", self._sent)
        self.DeclareStateOutputPort("iteration", self._iteration)

    def _write(self, state, known: Acquaintances) -> None:
        state.set_value(self._status, np.array(known.status, dtype=float))
        state.set_value(self._queue, np.array(known.queue, dtype=float))

    def _begin(self, context, discrete_state):
        self._network.begin()
        # A server may remember friends of an earlier run.
        self._write(discrete_state, with_friends(self._count, sorted(self._network.friends())))
        for index, size in (
            (self._tallies, 2 * self._count),
            (self._sent, 1),
            (self._iteration, 1),
        ):
            discrete_state.set_value(index, np.zeros(size))
        return EventStatus.Succeeded()

    def _iterate(self, context, discrete_state):
        def values(index) -> np.ndarray:
            return context.get_discrete_state(index).value()

        known = Acquaintances(
            tuple(int(each) for each in values(self._status)),
            tuple(int(each) for each in values(self._queue)),
        )
        wanted = self._interest.HasValue(context)
        interest = read(self._interest, context).tolist() if wanted else None
        number = int(values(self._iteration)[0])
        done = evolve(self._network, known, self._limits, number, interest)
        tallies = update_tallies(values(self._tallies).reshape(-1, 2), done)
        self._write(discrete_state, done.known)
        discrete_state.set_value(self._tallies, tallies.ravel())
        discrete_state.set_value(self._sent, values(self._sent) + done.requests_sent)
        discrete_state.set_value(self._iteration, np.array([number + 1.0]))

    def _calc_connected(self, context, output):
        output.set_value((self._statuses(context) == FRIEND).astype(float))

    def _calc_waiting(self, context, output):
        output.set_value((self._statuses(context) >= 0).astype(float))

    def _calc_counters(self, context, output):
        output.set_value(np.maximum(self._statuses(context), 0))

    def _statuses(self, context) -> np.ndarray:
        return context.get_discrete_state(self._status).value()


class ImageScanner(LeafSystem):
    """Fetches the N_img most recent pictures of every friend each period, none of them twice.

    .. pydrake_system::

        name: ImageScanner
        input_ports:
        - connected
        output_ports:
        - pictures
        - pictures_scanned

    ================  ==========================  ====  =====  ===========
    port              size                        unit  frame  feedthrough
    ================  ==========================  ====  =====  ===========
    connected         n                           -     -      -
    pictures          abstract: tuple of Picture  -     -      -
    pictures_scanned  1                           -     -      -
    ================  ==========================  ====  =====  ===========

    `connected` is `NetworkEvolution`'s. `pictures` holds the new pictures of the last look, perhaps
    none; `pictures_scanned` is their total number so far, which shows whether new ones have come.

    Source: Zhang 2014, Algorithm 3.

    Args:
        network: Whose agents are 0 to n - 1.
        count: N_img, pictures of each friend in one look.
        period: Between looks [s].
        offset: Of the first look [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self, network: SocialNetwork, *, count: int = 1, period: float = 1.0, offset: float = 0.0
    ):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("period", period)
        self._network, self._per_friend = network, count
        self._connected = self.DeclareVectorInputPort("connected", len(network.agents()))
        # The last scan, and how many pictures there were in all.
        self._state = self.DeclareAbstractState(AbstractValue.Make((Scan((), {}), 0)))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._look)
        state = {self.abstract_state_ticket(self._state)}
        self.DeclareAbstractOutputPort(
            "pictures",
            lambda: AbstractValue.Make(()),
            self._calc_pictures,
            prerequisites_of_calc=state,
        )
        self.DeclareVectorOutputPort(
            "pictures_scanned", 1, self._calc_count, prerequisites_of_calc=state
        )

    def _last(self, context) -> tuple[Scan, int]:
        return context.get_abstract_state(self._state).get_value()

    def _begin(self, context, state):
        state.get_mutable_abstract_state(self._state).set_value((Scan((), {}), 0))
        return EventStatus.Succeeded()

    def _look(self, context, state):
        last, count = self._last(context)
        friends = np.flatnonzero(read(self._connected, context) > 0.5).tolist()
        found = scan(self._network, friends, self._per_friend, last)
        record = (found, count + len(found.pictures))
        state.get_mutable_abstract_state(self._state).set_value(record)

    def _calc_pictures(self, context, output):
        output.set_value(self._last(context)[0].pictures)

    def _calc_count(self, context, output):
        output.set_value([float(self._last(context)[1])])


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

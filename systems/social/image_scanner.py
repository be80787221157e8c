"""What the pursuer reads in its friends' albums, as a system."""

import numpy as np
from pydrake.systems.framework import EventStatus, LeafSystem

from ..drake_types import AbstractValue, read
from ..numerics.errors import require_positive, require_whole
from ..numerics.social.network.interface import Scan, SocialNetwork, scan


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

    `connected` is `NetworkEvolution`'s. `pictures` are those that the last look found new, empty if
    none; `pictures_scanned` is how many there were in all, so it tells a new look from an old one.

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

"""Common agents share what they photograph."""

from typing import Any

from pydrake.systems.framework import EventStatus, LeafSystem

from ..drake_types import AbstractValue
from ..numerics.errors import require_non_negative, require_positive
from ..numerics.social.network.interface import SocialNetwork


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

"""Several policies in one team: each member takes its velocity from its own source."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require


class VelocitySelector(LeafSystem):
    """Passes on, for each member of a team, its velocity from one of several sources.

    .. pydrake_system::

        name: VelocitySelector
        input_ports:
        - source_0
        - source_1
        output_ports:
        - velocity

    ========  ====  ====  =====  ===========
    port      size  unit  frame  feedthrough
    ========  ====  ====  =====  ===========
    source_0  2 N   m/s   world  -
    source_1  2 N   m/s   world  -
    velocity  2 N   m/s   world  all
    ========  ====  ====  =====  ===========

    There are as many inputs `source_k` as sources; two are shown.

    Source: ours.

    Args:
        choices: Source of each member, shape (N,), from 0.
        sources: Number of sources.

    Raises:
        InvalidInput: A choice names no source.
    """

    def __init__(self, choices: Sequence[int], *, sources: int):
        super().__init__()
        require(len(choices) > 0, "choices", "name at least one member", list(choices))
        for choice in choices:
            require(0 <= choice < sources, "choices", f"lie in [0, {sources})", choice)
        self._choices = np.asarray(choices, dtype=int)
        size = 2 * len(choices)
        self._sources = [self.DeclareVectorInputPort(f"source_{k}", size) for k in range(sources)]
        self.DeclareVectorOutputPort("velocity", size, self._calc_velocity)

    def _calc_velocity(self, context, output):
        velocities = np.stack([read(port, context).reshape(-1, 2) for port in self._sources])
        chosen = velocities[self._choices, np.arange(len(self._choices))]
        output.set_value(chosen.ravel())

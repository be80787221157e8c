"""What a diagram keeps from tick to tick, taken out and put back: a replay goes on after a gap."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiscreteValues, System


class Memory:
    """The discrete state of systems, each by its path.

    Args:
        systems: Of a diagram, which may be built later, with all below them.
    """

    def __init__(self, systems: Sequence[System]) -> None:
        self._systems: dict[str, System] = {}
        self.sizes: dict[str, int] = {}
        for path, system in _leaves(systems, ""):
            size = _joined(system.AllocateDiscreteVariables()).size
            if size:
                self._systems[path], self.sizes[path] = system, size

    def read(self, root: Context) -> np.ndarray:
        """Everything in the order of `sizes`, shape (sum of the sizes,).

        Args:
            root: Of the whole diagram.
        """
        parts = [
            _joined(system.GetMyContextFromRoot(root).get_discrete_state())
            for system in self._systems.values()
        ]
        return np.concatenate([np.empty(0), *parts])

    def write(self, root: Context, values: Mapping[str, np.ndarray]) -> None:
        """Put back what is known of systems that are here and of the same size.

        Args:
            root: Of the whole diagram.
            values: By path, as many numbers each as the size.
        """
        for path, system in self._systems.items():
            known = values.get(path)
            if known is None or len(known) != self.sizes[path]:
                continue
            context = system.GetMyMutableContextFromRoot(root)
            at = 0
            for k in range(context.num_discrete_state_groups()):
                size = context.get_discrete_state(k).size()
                vector = context.get_mutable_discrete_state(k)
                vector.SetFromVector(known[at : at + size])  # type: ignore[arg-type]  # the stubs lag behind NumPy's
                at += size


def _leaves(systems: Sequence[System], prefix: str) -> Iterator[tuple[str, System]]:
    for system in systems:
        path = f"{prefix}/{system.get_name()}"
        if isinstance(system, Diagram):
            yield from _leaves(system.GetSystems(), path)
        else:
            yield path, system


def _joined(values: DiscreteValues) -> np.ndarray:
    groups = [values.get_vector(k).value() for k in range(values.num_groups())]
    return np.concatenate([np.empty(0), *groups])

"""What all schedulers of carts see."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.harvest.strategies.serving import Sight


def declare_sight(system: LeafSystem, combines: int, carts: int) -> None:
    """Declare a scheduler's input ports: tank, mode, alongside, load, room.

    Args:
        system: The scheduler.
        combines, carts: How many.
    """
    for name in ("tank", "mode", "alongside"):
        system.DeclareVectorInputPort(name, combines)
    for name in ("load", "room"):
        system.DeclareVectorInputPort(name, carts)


def read_sight(system: LeafSystem, context) -> Sight:
    """What there is to see now.

    Args:
        system: The scheduler.
        context: Its context.
    """
    values = [read(system.get_input_port(k), context) for k in range(5)]
    return Sight(context.get_time(), *values)

"""LeafSystems of the harvest story: drivers who keep to a plan, combines, carts, augers."""

from .machine_drivers import MachineDrivers
from .teams import AugerTransfer, CombineTeam, GrainCartTeam

__all__ = [
    "AugerTransfer",
    "CombineTeam",
    "GrainCartTeam",
    "MachineDrivers",
]

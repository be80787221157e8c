"""LeafSystems of the harvest story: drivers who keep to a plan, combines, carts, augers."""

from .auger_transfer import AugerTransfer
from .combine_team import CombineTeam
from .grain_cart_team import GrainCartTeam
from .machine_drivers import MachineDrivers

__all__ = [
    "AugerTransfer",
    "CombineTeam",
    "GrainCartTeam",
    "MachineDrivers",
]

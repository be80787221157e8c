"""LeafSystems of the harvest story: combines, carts, who unloads whom, and what is watched."""

from .auger_transfer import AugerTransfer
from .cart_driver import CartDriver
from .combine_guard import CombineGuard
from .combine_team import CombineTeam
from .grain_cart_team import GrainCartTeam
from .harvest_monitor import HarvestMonitor
from .on_demand_scheduler import OnDemandScheduler
from .unloading_scheduler import UnloadingScheduler

__all__ = [
    "AugerTransfer",
    "CartDriver",
    "CombineGuard",
    "CombineTeam",
    "GrainCartTeam",
    "HarvestMonitor",
    "OnDemandScheduler",
    "UnloadingScheduler",
]

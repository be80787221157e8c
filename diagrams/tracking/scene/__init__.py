"""What the tracking story looks like in Meshcat: the map, the robots, who sees whom, the clock."""

from .floor_layers import LosingSet
from .tracking_scene import TrackingScene, View

__all__ = ["LosingSet", "TrackingScene", "View"]

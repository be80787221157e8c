"""LeafSystems that keep a distance by a biased estimate: estimator, controller, closed loop."""

from .closed_loop import StandoffClosedLoop, StandoffClosedLoop_
from .range_estimator import BiasedRangeEstimator, BiasedRangeEstimator_
from .standoff_pid import StandoffPid, StandoffPid_

__all__ = [
    "BiasedRangeEstimator",
    "BiasedRangeEstimator_",
    "StandoffClosedLoop",
    "StandoffClosedLoop_",
    "StandoffPid",
    "StandoffPid_",
]

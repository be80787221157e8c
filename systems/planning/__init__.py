"""LeafSystems of the planning story: the tractor-trailer, and what drives it."""

from .path_follower import PathFollower
from .tractor_trailer import TractorTrailer, TractorTrailer_
from .value_function_feedback import ValueFunctionFeedback

__all__ = [
    "PathFollower",
    "TractorTrailer",
    "TractorTrailer_",
    "ValueFunctionFeedback",
]

"""Line-of-sight tracking and field logistics for teams of autonomous vehicles, as Drake systems.

Each story is a module: `from sightfield.tracking import MakeTracking`. What the stories' `__all__`
hold is the public interface; all else, below `sightfield.systems`, `sightfield.diagrams` and
`sightfield.hardware_io`, may change without notice.
"""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

"""Tracking on the pictures of omni-directional cameras, their optics and their calibration."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

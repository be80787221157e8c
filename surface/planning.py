"""Driving a tractor with a trailer from one configuration to another in the least time."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

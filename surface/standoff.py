"""Keeping a distance by a biased estimate of it: the loop, its analysis and its design."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

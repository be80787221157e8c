"""The laboratory: the tracking diagram on simulated, emulated and real robots."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

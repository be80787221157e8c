"""Team tracking: pursuers keep evaders in sight among obstacles."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

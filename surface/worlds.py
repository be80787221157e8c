"""Free regions with polygonal holes, and what can be seen in them."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

"""Games that are solved: round one corner, and on a whole map with all corners at once."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

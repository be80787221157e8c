"""Many games with common seeds, and what can be said of their censored times."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

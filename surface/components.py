"""What systems, scenarios and runs of your own need, whatever the story."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

"""Finding an evader in the pictures that friends post on a social network."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

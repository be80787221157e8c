"""Every name of every story, for `from sightfield.all import ...`, as `pydrake.all` has them."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

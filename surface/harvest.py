"""Grain carts that serve combines: schedules, plans of whole fields, and harvests by plan."""

from ._lazy import lazily

__getattr__, __dir__, __all__ = lazily(__name__, __file__)

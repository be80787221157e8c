"""Packages that only some parts need: extras of this one, and what to type where one is missing."""

from collections.abc import Iterable
from importlib.util import find_spec

from .errors import InvalidInput


def install_line(extra: str) -> str:
    """What to type to install an extra.

    Args:
        extra: Its name in `pyproject.toml`.
    """
    return f"pip install '.[{extra}]' in the checkout"


def missing_modules(modules: Iterable[str]) -> list[str]:
    """Those of several modules that are not installed.

    Args:
        modules: Their names, dotted too.
    """
    return [name for name in modules if not _is_installed(name)]


def require_extra(what: str, extra: str, modules: Iterable[str]) -> None:
    """Refuse what needs an extra that is not installed.

    Args:
        what: Needs it, as the message names it.
        extra: Its name in `pyproject.toml`.
        modules: By which it is imported.

    Raises:
        InvalidInput: One of them is not installed.
    """
    missing = missing_modules(modules)
    if missing:
        raise InvalidInput(
            f"{what} must come with the extra [{extra}]: {install_line(extra)}; "
            f"not installed: {', '.join(missing)}"
        )


def _is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        # Not even the package around it.
        return False

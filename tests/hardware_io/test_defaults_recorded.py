"""Numbers that callers may leave out, and constants that others use, are as recorded."""

import importlib
import inspect
import pkgutil

import pytest

PLAIN = (bool, int, float, str, tuple, type(None))
PACKAGES = (
    "hardware_io",
    "systems.station",
    "systems.social",
    "systems.standoff",
    "systems.numerics.station",
    "systems.numerics.social",
    "systems.numerics.standoff",
    "diagrams.station",
)
# Programs, which run when they are imported or need what is not installed.
ALONE = ("tracker_process", "local_server")


def modules_of(package):
    root = importlib.import_module(f"sightfield.{package}")
    yield root
    for found in pkgutil.walk_packages(getattr(root, "__path__", []), f"{root.__name__}."):
        if not found.name.endswith(ALONE):
            yield importlib.import_module(found.name)


def defaults_of(call):
    try:
        parameters = inspect.signature(call).parameters.values()
    except (TypeError, ValueError):
        return {}
    return {p.name: p.default for p in parameters if isinstance(p.default, PLAIN)}


def plain(value):
    return value if isinstance(value, (bool, int, float, str)) or value is None else repr(value)


def public(module):
    for name, value in vars(module).items():
        if not name.startswith("_"):
            yield name, value


@pytest.mark.parametrize("package", PACKAGES)
def test_what_may_be_left_out_is_as_recorded(package, as_recorded):
    found = {}
    for module in modules_of(package):
        for name, value in public(module):
            if getattr(value, "__module__", "") != module.__name__:
                continue
            for label, call in ((name, value), *((f"{name}.{n}", c) for n, c in public(value))):
                defaults = defaults_of(call) if callable(call) else {}
                if defaults:
                    at = f"{module.__name__.removeprefix('sightfield.')}.{label}"
                    found[at] = {key: plain(each) for key, each in sorted(defaults.items())}
    as_recorded(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_constants_are_as_recorded(package, as_recorded):
    as_recorded(
        {
            f"{module.__name__.removeprefix('sightfield.')}.{name}": value
            for module in modules_of(package)
            for name, value in public(module)
            if name.isupper() and isinstance(value, (bool, int, float))
        }
    )

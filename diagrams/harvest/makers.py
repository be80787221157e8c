"""Machines of makers by name: public figures of theirs, where a scenario says nothing else.

A machine is named as in `machine: claas-lexion-8900`, or with the crop by whose test weight its
volumes count, as in `machine: claas-lexion-8900 corn`; without one that is wheat.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from importlib import resources
from typing import Any, TypeVar

import yaml
from pydantic import model_validator

from ...systems.numerics.errors import require_one_of
from ...systems.numerics.units import TEST_WEIGHTS, WrongQuantity, read_quantity
from . import catalogue

Made = TypeVar("Made")

# Of figures in the catalogue, the units of a scenario.
_UNITS = {
    "header_width": "m",
    "capacity": "kg",
    "unload_rate": "kg/s",
    "truck_rate": "kg/s",
    "engine_power": "W",
}
USUAL_CROP = "wheat"


@dataclass(frozen=True)
class MakersMachine:
    """A machine in the catalogue.

    Attributes:
        maker, model: Whose, and which.
        figures: By the keys of a scenario, as they were published, with units.
        sources: Where.
    """

    maker: str
    model: str
    figures: dict[str, str]
    sources: tuple[str, ...]


@cache
def machines_of_makers(kind: str) -> dict[str, MakersMachine]:
    """The catalogue by names.

    Args:
        kind: "combines" or "carts".
    """
    text = (resources.files(catalogue) / f"{kind}.yaml").read_text(encoding="utf-8")
    return {
        name: MakersMachine(each["maker"], each["model"], each["figures"], tuple(each["sources"]))
        for name, each in yaml.safe_load(text).items()
    }


def figures_of(kind: str, machine: str, key: str = "machine") -> dict[str, float]:
    """What is known of a machine, in the units of a scenario.

    Args:
        kind: "combines" or "carts".
        machine: Its name, and a crop or none behind it; empty: no machine.
        key: Of what names it, for the message.

    Raises:
        InvalidInput: There is no such machine, or no such crop.
    """
    if not machine:
        return {}
    name, _, crop = machine.partition(" ")
    require_one_of(key, name, tuple(machines_of_makers(kind)))
    crop = crop.strip() or USUAL_CROP
    require_one_of(key, crop, tuple(sorted(TEST_WEIGHTS)))
    found = {}
    for each, text in machines_of_makers(kind)[name].figures.items():
        try:
            found[each] = read_quantity(each, text, _UNITS[each])
        except WrongQuantity:
            # Volumes name their crop.
            found[each] = read_quantity(each, f"{text} {crop}", _UNITS[each])
    return found


def settings_of_machines(settings: Sequence[str]) -> list[str]:
    """Settings that give a scenario the figures of machines that others of them name.

    Whoever sets a machine wants its figures, not those that the scenario has for another one.

    Args:
        settings: As `key=value`.
    """
    found = []
    for kind in ("combines", "carts"):
        key = f"{kind}.machine"
        for setting in settings:
            if setting.startswith(f"{key}="):
                machine = setting.removeprefix(f"{key}=").strip().strip("'\"")
                figures = figures_of(kind, machine, key)
                found += [f"{kind}.{each}={value!r}" for each, value in figures.items()]
    return found


def with_makers_figures(kind: str) -> Callable[[type[Made]], type[Made]]:
    """A dataclass whose field `machine` stands for what the catalogue knows of the machine.

    What is said besides holds, in Python as in a file.

    Args:
        kind: "combines" or "carts".
    """

    def known(said: Any) -> Any:
        # What is no mapping, or names no machine by a text, pydantic refuses.
        if not isinstance(said, dict) or not isinstance(said.get("machine"), str):
            return said
        return {**figures_of(kind, said["machine"]), **said}

    def decorate(made: type[Made]) -> type[Made]:
        usual = made.__init__

        @wraps(usual)
        def init(self: Made, **said: Any) -> None:
            usual(self, **{**figures_of(kind, said.get("machine", "")), **said})

        made.__init__ = init
        hook = model_validator(mode="before")(staticmethod(known))
        made.known_of_makers = hook  # pyright: ignore[reportAttributeAccessIssue]  # For pydantic.
        return made

    return decorate

"""Kinds of robots by name: those of this package, and those of one's own."""

import os
import sys
from importlib import import_module

from ...systems.numerics.errors import InvalidInput, require
from .crtp import CRTP
from .dds import DDS
from .mavlink import MAVLINK
from .robot_kind import RobotKind
from .udp import UDP
from .xbee import XBEE

KINDS = {kind.name: kind for kind in (XBEE, UDP, MAVLINK, DDS, CRTP)}


def find_kind(name: str) -> RobotKind:
    """A kind of robots.

    Args:
        name: Of one of ours, or `module:NAME` for a RobotKind of one's own, in a module that Python
            finds in the present folder or among what is installed. The module is run.

    Raises:
        InvalidInput: There is none.
    """
    module, _, attribute = name.partition(":")
    if not attribute:
        wish = f"be one of {', '.join(KINDS)}, or module:NAME of one's own"
        require(name in KINDS, "radio.kind", wish, name)
        return KINDS[name]
    # A command that is installed does not look there by itself.
    sys.path.insert(0, os.getcwd())
    try:
        kind = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise InvalidInput(
            f"`radio.kind` must be a module and a name in it; got {name}: {error}"
        ) from None
    finally:
        sys.path.pop(0)
    require(isinstance(kind, RobotKind), "radio.kind", "name a RobotKind", type(kind).__name__)
    return kind

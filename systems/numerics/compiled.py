"""How functions are compiled.

`compiled` is for functions that are called from Python, or that make arrays. `kernel` is for the
small ones inside, which only read and write arrays that they are given: without Numba's counting
of references, which is atomic and would cost more than the geometry does.

What is compiled is kept on disk for the next process. A fresh installation has nothing, and its
first commands take up to a minute longer: that is logged.
"""

import logging

from numba import njit
from numba.core import event

# Compiled functions after which it is no longer a matter of a moment.
_MANY = 10

_LOG = logging.getLogger(__name__)


class _Announcer(event.Listener):
    """Logs once that much is compiled."""

    def __init__(self) -> None:
        self.compiled = 0

    def on_start(self, event: event.Event) -> None:
        self.compiled += 1
        if self.compiled == _MANY:
            _LOG.info("compiling for this machine, once: this may take a minute")

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _Announcer())

compiled = njit(cache=True)
kernel = njit(cache=True, _nrt=False)  # type: ignore[call-overload]  # an option of all targets

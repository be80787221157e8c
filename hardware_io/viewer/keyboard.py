"""Single keys in the terminal: the emergency stop that needs no page."""

import os
import select
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress

# How long the thread waits for a key before it looks whether it shall end [s].
_WAIT = 0.1


@contextmanager
def keys(
    actions: Mapping[str, Callable[[], object]], terminal: int | None = None
) -> Iterator[bool]:
    """Do what each key stands for while the block runs; yield whether there is a terminal.

    Args:
        actions: By key, a character each.
        terminal: Its file descriptor; None for standard input.
    """
    place = terminal
    if place is None:
        # A service has no standard input, and one that was replaced has no descriptor.
        with suppress(AttributeError, OSError):
            place = sys.stdin.fileno()
    if place is None or not os.isatty(place):
        yield False
        return
    # Of terminals alone; other systems have none of these.
    import termios
    import tty

    before = termios.tcgetattr(place)
    ended = threading.Event()

    def listen() -> None:
        while not ended.is_set():
            if select.select([place], [], [], _WAIT)[0]:
                for key in os.read(place, 64).decode(errors="ignore"):
                    actions.get(key, lambda: None)()

    thread = threading.Thread(target=listen, daemon=True)
    # Keys come at once, and Ctrl-C still works.
    tty.setcbreak(place)
    thread.start()
    try:
        yield True
    finally:
        ended.set()
        thread.join()
        termios.tcsetattr(place, termios.TCSADRAIN, before)

"""How a process asks the system to let it run at once: before other programs, on a CPU awake.

Both need leave, which a laboratory gives to the account of its work station (docs/laboratory.md).
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

# Where Linux is told how long CPUs may take to wake, for as long as the file is open (PM QoS).
LATENCY_FILE = "/dev/cpu_dma_latency"
# So long [us], as a whole number of 32 bits: none of them falls asleep.
_AT_ONCE = (0).to_bytes(4, "little")


def go_first(process: int = 0) -> bool:
    """Let a process, and the threads that it begins, run before others; whether it may.

    Args:
        process: Its number; 0: this one.
    """
    try:
        os.sched_setscheduler(process, os.SCHED_RR, os.sched_param(1))
    except (OSError, AttributeError):
        # No permission, or another system than Linux.
        return False
    return True


@contextmanager
def keep_awake(file: str = LATENCY_FILE) -> Iterator[bool]:
    """Let CPUs wait for work without sleep, inside `with`; yields whether this process may.

    A command to robots wakes three processes, each of which may sleep for longer than its work
    takes. CPUs sleep as ever after a process that was killed.

    Args:
        file: Where the system is told so.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(open(file, "wb", buffering=0)).write(_AT_ONCE)
        except OSError:
            # No permission, or another system than Linux.
            may = False
        else:
            may = True
        yield may

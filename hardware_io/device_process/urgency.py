"""Low latency for a process: real-time scheduling, and CPUs that do not sleep.

Both need permissions, which a laboratory gives to its work station's account (docs/laboratory.md).
"""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

# Linux keeps the wake-up latency of CPUs below the value written here while the file is open
# (PM QoS).
LATENCY_FILE = "/dev/cpu_dma_latency"
# Latency of 0 us, as a 32-bit integer: CPUs do not sleep at all.
_AT_ONCE = (0).to_bytes(4, "little")


def go_first(process: int = 0) -> bool:
    """Give a process and its new threads real-time priority; returns whether that was permitted.

    Args:
        process: Process id; 0: this process.
    """
    try:
        os.sched_setscheduler(process, os.SCHED_RR, os.sched_param(1))
    except (OSError, AttributeError):
        # No permission, or another system than Linux.
        return False
    return True


@contextmanager
def keep_awake(file: str = LATENCY_FILE) -> Iterator[bool]:
    """Keep CPUs from sleeping inside `with`; yields whether that was permitted.

    A command to robots wakes three processes, and each wake-up of a sleeping CPU may take longer
    than the work. If the process is killed, CPUs may sleep again.

    Args:
        file: File of the system that takes the permitted latency.
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

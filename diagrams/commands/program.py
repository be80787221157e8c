"""The program `sightfield`: what a signal does to it, from its first moment on.

While it only imports and reads its words, and after it has said what came out, a signal ends it at
once. A command at work is interrupted instead, as by Ctrl-C in any program of Python, and puts away
what it has begun. Either way the exit code is 128 and the signal's number, and nothing is printed,
wherever in Python the signal comes.
"""

# Nothing else: until a signal is answered, it ends in a traceback or leaves things behind.
import os
import signal
import sys

# Ctrl-C, a request to end as `kill` and `timeout` send it, and a terminal that is closed.
_ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_UNANSWERED = (signal.SIG_DFL, signal.default_int_handler)

# How long what has swallowed an interruption may take to go, before the next one [s].
_SWALLOWED = 0.01

# Threads of the linear algebra, unless somebody has said how many: its matrices are small here, and
# threads that wait for one another spin. Two processes on two cores took four times as long.
_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Ending:
    """What ends the program from outside.

    Attributes:
        at_work: Whether a command is.
        first: Number of the signal that interrupted it; None: none has.
    """

    def __init__(self) -> None:
        self.at_work = False
        self.first: int | None = None
        self._asked = False

    def answer(self) -> None:
        """Answer signals from now on, but those that whoever started the program has ignored."""
        sys.unraisablehook = self._hear
        for number in _ENDS:
            if signal.getsignal(number) in _UNANSWERED:
                signal.signal(number, self._handle)

    def begin(self) -> None:
        """A command is at work."""
        self.at_work = True

    def _handle(self, number: int, frame: object) -> None:
        if not self.at_work:
            # Modules that are half imported would swallow an exception, or complain of it.
            os._exit(128 + number)
        if number != signal.SIGINT:
            if self._asked:
                # `timeout` asks twice; what is put away meanwhile is to be put away whole.
                return
            self._asked = True
        self.first = self.first or number
        raise KeyboardInterrupt

    def _hear(self, complaint: "sys.UnraisableHookArgs") -> None:
        """Hear of an exception that nothing could catch, as of a thing that went."""
        if self.first is None:
            sys.__unraisablehook__(complaint)
        elif self.at_work and complaint.exc_type is KeyboardInterrupt:
            # Loaded by whatever is at work, and not needed before.
            import threading

            # To this very thread: it may be waiting by then.
            to_whom = threading.get_ident(), self.first
            again = threading.Timer(_SWALLOWED, self._interrupt, to_whom)
            again.daemon = True
            again.start()
        # The rest is about things that the interruption left half made.

    def _interrupt(self, thread: int, number: int) -> None:
        if self.at_work:
            self._asked = False
            signal.pthread_kill(thread, number)


def main() -> None:
    """Run the command line, see `app.main`."""
    ending, code = Ending(), None
    ending.answer()
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")
    from .app import main as run

    try:
        run(ending.begin)
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    except SystemExit as end:
        code = end.code
    finally:
        ending.at_work = False
    if ending.first is not None and code == 128 + signal.SIGINT:
        # A command at work knows of Ctrl-C alone.
        code = 128 + ending.first
    sys.exit(code)

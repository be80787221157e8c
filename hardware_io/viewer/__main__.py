"""`python -m sightfield.hardware_io.viewer PORT`: the process of the operator's view."""

import contextlib
import sys

from .server import serve

if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        serve(int(sys.argv[1]))

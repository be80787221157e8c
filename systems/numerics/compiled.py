"""How functions are compiled.

`compiled` is for functions that are called from Python, or that make arrays. `kernel` is for the
small ones inside, which only read and write arrays that they are given: without Numba's counting
of references, which is atomic and would cost more than the geometry does.
"""

from numba import njit

compiled = njit(cache=True)
kernel = njit(cache=True, _nrt=False)  # type: ignore[call-overload]  # an option of all targets

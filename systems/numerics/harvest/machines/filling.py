"""What a combine does, and the account that is kept of it.

Each kilogram that leaves the crop is added to one place: a tank, a cart or the ground.
"""

import numpy as np

# Modes of a combine.
WAITING, CUTTING, UNLOADING, FULL, BLOCKED, DONE = range(6)
MODES = ("waiting", "cutting", "unloading", "full", "blocked", "done")

# Those in which it stands.
STANDING_MODES = (WAITING, FULL, BLOCKED, DONE)
# The same for every mode, to be looked up.
STANDS = np.isin(np.arange(len(MODES)), STANDING_MODES)

# Columns of a combine's account: way driven along its path [m]; tank, all that was cut and all
# that was spilt [kg]; time spent full and standing, spilling, and held up by others [s]; mode.
STATION, TANK, CUT, LOST, STOP_TIME, OVERFLOW_TIME, BLOCK_TIME, MODE = range(8)
COLUMNS = 8

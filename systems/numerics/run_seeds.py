"""Seeds of the runs of a study: a run has the same seed in every cell, and no two runs share one.

They are apart from `statistics`, so that processes that play games need not load SciPy's.
"""

import numpy as np

from .errors import require


def run_seed(root: int, run: int) -> int:
    """Seed of one run: the run-th child that `SeedSequence(root)` would spawn.

    Args:
        root: Seed of the study.
        run: Number of the run, from 0.

    Returns:
        In [0, 2^53), so that JSON holds it exactly.

    Raises:
        InvalidInput: A number is negative.
    """
    require(root >= 0, "seed", "be zero or positive", root)
    require(run >= 0, "run", "be zero or positive", run)
    child = np.random.SeedSequence(root, spawn_key=(run,))
    return int(child.generate_state(1, np.uint64)[0] >> np.uint64(11))

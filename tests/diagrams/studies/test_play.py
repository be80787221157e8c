"""What plays the games of studies starts quickly: each of its processes pays for its imports."""

import subprocess
import sys


def test_a_process_that_plays_games_loads_nothing_that_draws_or_judges_them():
    code = """
import sys
import sightfield.diagrams.studies.play
print([name for name in ("matplotlib", "scipy.stats", "pyarrow") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("[]\n", "")

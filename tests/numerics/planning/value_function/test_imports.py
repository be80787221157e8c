"""The value function stands below the minimum-time programme."""

import pkgutil
import subprocess
import sys

from sightfield.systems.numerics.planning import value_function


def test_a_process_that_loads_the_value_function_loads_no_casadi():
    names = [
        f"{value_function.__name__}.{each.name}"
        for each in pkgutil.iter_modules(value_function.__path__)
    ]
    assert len(names) > 5
    code = f"""
import importlib, sys
for name in {names!r}:
    importlib.import_module(name)
print("casadi" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("False\n", "")

"""A signal ends the program quietly, and leaves nothing of a run that it breaks off."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sightfield.diagrams.commands.program import Ending

SIGHTFIELD = Path(sys.executable).with_name("sightfield")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

# The program, to which a signal comes as it imports a module, in a place where exceptions are
# swallowed: whatever is called as a thing goes.
IMPORTS = """
import os, sys
from sightfield.diagrams.commands.program import main

class Going:
    def __del__(self):
        os.kill(os.getpid(), {number})

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "{module}":
            Going()

sys.meta_path.insert(0, Finder)
sys.argv = ["sightfield", "track", "--no-meshcat", "--seconds", "1"]
main()
"""


@pytest.fixture(autouse=True)
def nothing_is_ignored():
    """What ignores signals, such as `nohup` before the tests, would have the program do so too."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    for number in SIGNALS:
        if before[number] == signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def run(code):
    """What came of a program."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("module", ["typer", "sightfield.diagrams.commands.track", "pydrake"])
def test_a_signal_while_the_program_imports_ends_it_without_a_word(number, module):
    code = IMPORTS.format(number=int(number), module=module)
    done = run(code)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", "")


def test_little_is_imported_before_signals_are_answered():
    code = (
        "import sys; before = set(sys.modules); import sightfield.diagrams.commands.program; "
        "print(*{name.partition('.')[0] for name in set(sys.modules) - before})"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    others = set(done.stdout.split()) - set(sys.stdlib_module_names)
    assert others == {"sightfield"}


@pytest.mark.parametrize("said", ["", "2"])
def test_linear_algebra_has_one_thread_unless_somebody_has_said_how_many(said):
    """Threads of programs side by side on few cores wait for one another, and spin."""
    code = (
        "import os, sys; from sightfield.diagrams.commands.program import main\n"
        "sys.argv = ['sightfield', '--version']\n"
        "try: main()\n"
        "finally: print(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    others = {name: value for name, value in os.environ.items() if "BLAS" not in name}
    surroundings = others | ({"OPENBLAS_NUM_THREADS": said} if said else {})
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=surroundings
    )
    assert done.stdout.splitlines()[-1] == (said or "1")


# The program, whose command is told to end in places where an exception cannot be caught.
WORKS = """
import os, sys, time, types

class Going:
    def __del__(self):
        {sends}

class HalfMade:
    def __init__(self):
        {sends}
        self.whole = True
    def __del__(self):
        assert self.whole

def main(begin):
    begin()
    {does}
    time.sleep(50)

sys.modules["sightfield.diagrams.commands.app"] = types.SimpleNamespace(main=main)
from sightfield.diagrams.commands.program import main
main()
"""


@pytest.mark.timeout(40)
@pytest.mark.parametrize("does", ["HalfMade()", "Going()"])
@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_a_command_wherever_it_comes(number, does):
    """As compilers make half of a thing, which complains as it goes, or swallow what is raised."""
    code = WORKS.format(sends=f"os.kill(os.getpid(), {int(number)})", does=does)
    done = run(code)
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", "")


def test_what_cannot_be_caught_is_told_as_long_as_nothing_ends_the_program():
    code = WORKS.format(sends="return", does="HalfMade(); return")
    done = run(code)
    assert done.returncode == 0
    assert "AttributeError: 'HalfMade' object has no attribute 'whole'" in done.stderr


@pytest.mark.parametrize("number", SIGNALS)
def test_a_run_that_a_signal_breaks_off_leaves_nothing(number, tmp_path):
    words = ["track", "corner_1v1", "--no-meshcat", "--realtime", "1"]
    program = subprocess.Popen(
        [SIGHTFIELD, *words, "--out", tmp_path / "out"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.iterdir()) and program.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.3)
    # `timeout` sends it twice, once to the program and once to its group.
    for _ in range(1 if number == signal.SIGINT else 2):
        program.send_signal(number)
        time.sleep(0.001)
    said, complaints = program.communicate(timeout=60)
    assert (program.returncode, said, complaints) == (128 + number, "", "")
    assert list(tmp_path.iterdir()) == []


def test_what_whoever_starts_the_program_has_ignored_stays_ignored():
    told = sys.unraisablehook
    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_DFL)
        # As `nohup` does.
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        ending = Ending()
        ending.answer()
        ending.begin()
        os.kill(os.getpid(), signal.SIGHUP)
        assert ending.first is None
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGTERM)
        assert ending.first == signal.SIGTERM
    finally:
        sys.unraisablehook = told
        for number, handler in before.items():
            signal.signal(number, handler)

"""A page is ended by the thread that made it, whichever thread finds that nobody holds it."""

import subprocess
import sys

import pytest

# Another thread finds a page that refers to itself. Drake would abort the process.
FOUND_ELSEWHERE = """
import gc, threading, urllib.request
from pydrake.geometry import Meshcat, MeshcatParams
from sightfield.diagrams.standoff.laboratory import StandoffPage
from sightfield.diagrams.standoff.make_standoff import StandoffScenario
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.diagrams.visuals.stage import Stage

class Ring:
    pass

def drakes():
    return Meshcat(MeshcatParams(host="localhost", port=0, show_stats_plot=False))

def on_a_stage(page):
    return Stage(page, "/here", recording=False, period=0.1, tolerance=0.01)

def make():
    ring = Ring()
    ring.itself = ring
    ring.page = {made}
    ring.shown = [{shown}]
    return Meshcat.web_url(ring.page)

def answers(address):
    try:
        return urllib.request.urlopen(address, timeout=10).status == 200
    except OSError:
        return False

gc.disable()
address = make()
thread = threading.Thread(target=gc.collect)
thread.start()
thread.join()
print("still there", answers(address))
ring = make()
print("ended", not answers(address))
"""


@pytest.mark.parametrize(
    ("made", "shown"),
    [
        ("open_live_page(port=0)", ""),
        ("drakes()", "on_a_stage(ring.page), on_a_stage(ring.page)"),
        ("drakes()", "StandoffPage(ring.page, StandoffScenario())"),
    ],
    ids=["live page", "stage", "sliders"],
)
def test_a_page_that_another_thread_finds_is_ended_by_its_own(made, shown):
    code = FOUND_ELSEWHERE.format(made=made, shown=shown)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split("\n")) == (
        0,
        ["still there True", "ended True", ""],
    ), done.stderr

"""Makes the pictures of the README: runs the commands, opens their replays, takes screenshots.

Run by `make pictures`, or `make pictures ARGS="harvest schedule"` for some; needs Chromium.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Error, Page, sync_playwright

HERE = Path(__file__).parent
SIGHTFIELD = Path(sys.executable).with_name("sightfield")

# Picture, command that leaves a replay in its folder, moment of that [s].
REPLAYS = [
    ("thesis_3v4", ["track", "thesis_3v4", "--no-meshcat"], 20.0),
    ("omni_2v2", ["camera", "track", "omni_2v2", "--no-meshcat"], 6.0),
    ("plan_replay", ["plan"], 2.5),
    # A second of the replay is a minute of work.
    ("harvest", ["harvest", "thesis_2", "--no-meshcat"], 15.8),
    ("social", ["social", "--no-meshcat", "--seed", "2", "--seconds", "12"], 9.0),
]

# Picture, command that draws it in its folder, name of the drawing.
DRAWINGS = [
    ("risk_vectors", ["track", "risk_vectors", "--no-replay"], "tracks.png"),
    ("corner", ["corner"], "corner.png"),
    ("guarantee", ["guarantee", "thesis_3v4"], "guarantee.png"),
    ("calibration", ["camera", "calibrate"], "error_curves.png"),
    ("standoff", ["standoff", "--controller", "PD", "--analyse"], "responses.png"),
    (
        "schedule",
        [
            *("schedule", "--combines", "3", "--capacity", "9000", "--fill-rate", "20"),
            *("--unload-rate", "150", "--travel-time", "60"),
        ],
        "loads.png",
    ),
    ("plan", ["plan"], "paths.png"),
    (
        "study",
        ["study", "tracking", "--runs", "100", "--opponent-runs", "best_response=40"],
        "means.png",
    ),
    ("map", ["study", "map"], "map.png"),
]

# Picture, run of a station that shows it in the operator's view, moment of that [s].
VIEWS = [("station", ["station", "--emulate", "--seconds", "25"], 4.0)]
VIEW_PORT = "7055"

# Picture of the head of the page that a command leaves in its folder.
REPORT = ("reproduction", ["reproduce", "--quick"])

CHROMIUM = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main(names: list[str]) -> None:
    """Make pictures in docs/pictures: those of some names, or all."""

    def chosen(entries: list) -> list:
        return [entry for entry in entries if not names or entry[0] in names]

    known = [entry[0] for entry in (*REPLAYS, *VIEWS, *DRAWINGS, REPORT)]
    if unknown := set(names) - set(known):
        sys.exit(f"no pictures {sorted(unknown)}; there are {', '.join(known)}")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=CHROMIUM
        )
        for name, command, moment in chosen(REPLAYS):
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            show_replay(page, command, moment, Path(folder) / name)
            page.screenshot(path=HERE / "pictures" / f"{name}.png")
        for name, command, moment in chosen(VIEWS):
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            show_view(page, command, moment, HERE / "pictures" / f"{name}.png")
        for name, command in chosen([REPORT]):
            page = browser.new_page(viewport={"width": 1280, "height": 900})
            subprocess.run([SIGHTFIELD, *command, "--out", Path(folder) / name], check=True)
            page.goto((Path(folder) / name / "report.html").as_uri())
            page.screenshot(path=HERE / "pictures" / f"{name}.png")
        browser.close()
        for name, command, drawing in chosen(DRAWINGS):
            out = Path(folder) / name
            subprocess.run([SIGHTFIELD, *command, "--out", out], check=True)
            shutil.copy(out / drawing, HERE / "pictures" / f"{name}.png")


def show_replay(page: Page, command: list[str], moment: float, out: Path) -> None:
    """Run a command, and wind the replay in its folder to a moment [s]."""
    subprocess.run([SIGHTFIELD, *command, "--out", out], check=True)
    page.goto((out / "replay.html").as_uri())
    page.wait_for_function("typeof viewer !== 'undefined' && viewer.animator.duration > 0")
    page.evaluate("viewer.animator.pause()")
    page.evaluate(f"viewer.animator.seek({moment})")
    page.wait_for_timeout(1000)


def show_view(page: Page, command: list[str], moment: float, picture: Path) -> None:
    """Run a station, and take a picture of the operator's view at a moment [s]."""
    run = subprocess.Popen([SIGHTFIELD, *command, "--view", "--port", VIEW_PORT])
    address = f"http://127.0.0.1:{VIEW_PORT}/"
    while True:
        try:
            page.goto(address)
            break
        except Error:
            if run.poll() is not None:
                sys.exit(f"the station ended with {run.returncode} and shows nothing")
            page.wait_for_timeout(200)
    page.wait_for_function(
        f"parseFloat(document.querySelector('#status').textContent) > {moment}", timeout=60_000
    )
    page.screenshot(path=picture)
    run.terminate()
    run.wait()
    # The view outlives its runs.
    os.kill(page.request.get(f"{address}state").json()["pid"], signal.SIGTERM)


main(sys.argv[1:])

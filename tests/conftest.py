"""What tests of several parts need: programs, the wheel, and a page in headless Chromium."""

import fcntl
import gc
import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

# As the program does, before anything loads NumPy, and for all processes that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from sightfield.diagrams.commands.app import import_command, main

pytest_plugins = ["recorded_results"]

ROOT = Path(__file__).resolve().parents[1]
VIEWPORT = {"width": 1280, "height": 720}

# Software rendering, so that WebGL works without a graphics card, and no traffic of its own.
CHROMIUM_ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


def pytest_collection_finish() -> None:
    """What was imported stays, so that nobody need look again and again whether it may go."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory) -> Path:
    """A folder that all test processes of a run have in common."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


@pytest.fixture(scope="session")
def made_once(shared_folder) -> Callable[[str, Callable[[Path], None]], Path]:
    """A function of a folder's name and of what fills that folder, which it returns.

    It is filled once for all test processes: whoever comes second waits for it. If that fails,
    whoever comes next tries again.
    """

    def make(name: str, fill: Callable[[Path], None]) -> Path:
        folder, filled = shared_folder / name, shared_folder / f"{name}.filled"
        with (shared_folder / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not filled.exists():
                shutil.rmtree(folder, ignore_errors=True)
                folder.mkdir()
                fill(folder)
                filled.touch()
        return folder

    return make


@pytest.fixture(scope="session", autouse=True)
def games_of_tests(shared_folder) -> Iterator[None]:
    """Solved visibility games are kept in a folder of the tests, and not in the user's cache.

    In one folder for all test processes: what one has solved the others need not.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIGHTFIELD_GAMES", str(shared_folder / "games"))
        yield


def find_tool(name: str, debian_package: str, *other_names: str) -> str:
    """Path of a program, which may go by several names.

    Without it the test is skipped, saying what to type; where CI=true it fails.
    """
    for each in (name, *other_names):
        path = shutil.which(each)
        if path is not None:
            return path
    reason = f"{name} is not installed: sudo apt-get install {debian_package}"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def require_tool() -> Callable[..., str]:
    """A function of a program, its Debian package and other names it has: the program's path."""
    return find_tool


@pytest.fixture(scope="session")
def run_program() -> Callable[..., str]:
    """A function that runs a command, which must succeed, and returns what it printed."""

    def run(*command: object, **options: object) -> str:
        done = subprocess.run(
            [str(word) for word in command],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            **options,  # type: ignore[call-overload]  # passed through as given
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    return run


@pytest.fixture
def sightfield_here(monkeypatch, capsys) -> Callable[..., SimpleNamespace]:
    """A function that runs `sightfield` with words as its program does, in this process.

    What it gives has the names of a finished process: returncode, stdout, stderr.
    """

    def run(*words: object) -> SimpleNamespace:
        monkeypatch.setattr(sys, "argv", ["sightfield", *map(str, words)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return SimpleNamespace(returncode=ended.value.code or 0, stdout=said.out, stderr=said.err)

    return run


# Options with which a command does little: the first seconds of a game, fleets of few machines side
# by side, some of a calibration's pictures.
BEGINNINGS = {"--seconds": "3", "--most": "2,1,1", "--directions": "3"}

# Settings by command with which its scenario is a small one: a field of a hectare, a coarse table.
SMALL = {"harvest": ("field.width=120", "field.height=90"), "track": ("pursuers.grid=0.4",)}


@pytest.fixture(scope="session")
def begun() -> Callable[[list[str]], list[str]]:
    """A function of the words after `sightfield`: the same, for the beginning of what it does.

    Where a page says what can be typed, the beginning shows that it can.
    """

    def shorten(words: list[str]) -> list[str]:
        command, rest = import_command(words[0]), words[1:]
        while rest and rest[0] in getattr(command, "commands", {}):
            command = command.commands[rest.pop(0)]
        # What runs by default has its options.
        command = getattr(command, "commands", {}).get("run", command)
        known = {name for option in command.params for name in option.opts}
        for name, value in BEGINNINGS.items():
            idle = name == "--directions" and "--practice" in known.difference(words)
            if name in known and not idle:
                words = [*_without(words, name), name, value]
        if "--set" in known and not {"--field", "--resume"} & set(words):
            for setting in SMALL.get(words[0], ()):
                key = setting.partition("=")[0]
                words = [*_without(words, f"--{key}"), "--set", setting]
        return words

    return shorten


def _without(words: list[str], option: str) -> list[str]:
    """Words of a command without what they say of an option's value, as nothing is said twice."""
    kept: list[str] = []
    for word, following in zip(words, [*words[1:], ""], strict=True):
        if kept and kept[-1] == option:
            kept.pop()
        elif word != "--set" or not following.startswith(f"{option[2:]}="):
            kept.append(word)
    return [word for word in kept if not word.startswith(f"{option[2:]}=")]


@pytest.fixture(scope="session")
def wheel(made_once, tmp_path_factory, run_program) -> Path:
    """A wheel, built from a copy so that no earlier build leaks into it."""

    def build(out: Path) -> None:
        source = tmp_path_factory.mktemp("source")
        described = tomllib.loads((ROOT / "pyproject.toml").read_text())
        project, parts = described["project"], described["tool"]["setuptools"]["package-dir"]
        for file in ("pyproject.toml", project["readme"], *project["license-files"]):
            shutil.copy(ROOT / file, source)
        for folder in (*parts.values(), "tests"):
            caches = shutil.ignore_patterns("__pycache__")
            shutil.copytree(ROOT / folder, source / folder, ignore=caches)
        pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-index"]
        run_program(*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", out, source)

    (built,) = made_once("wheel", build).glob("*.whl")
    return built


@pytest.fixture(scope="session")
def wheel_folder(wheel, made_once, run_program) -> Path:
    """A fresh folder with nothing but the wheel installed into it."""

    def install(folder: Path) -> None:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"]
        run_program(*pip, "--target", folder, wheel)
        _take_compiled(folder / "sightfield")

    return made_once("target", install)


def _take_compiled(package: Path) -> None:
    """Copy to an install what Numba compiled of the checkout's sources, which are the same.

    Numba keeps a hash of the source with it and would compile what differs.
    """
    for file in (ROOT / "systems").rglob("*.nb[ic]"):
        target = package / file.relative_to(ROOT)
        target.parent.mkdir(exist_ok=True)
        shutil.copy(file, target)


@pytest.fixture(scope="session")
def wheel_places(wheel_folder) -> list[str]:
    """Where Python, started with -I and -S, finds the wheel and the dependencies.

    -S leaves out the .pth files of site-packages, by which an editable install is found.
    """
    return [str(wheel_folder), sysconfig.get_path("purelib"), sysconfig.get_path("platlib")]


@pytest.fixture(scope="session")
def browser(require_tool) -> Iterator[Browser]:
    """Headless Chromium with a profile of its own."""
    path = require_tool("chromium", "chromium", "chromium-browser", "google-chrome")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=path, headless=True, args=CHROMIUM_ARGUMENTS
        )
        yield chromium
        chromium.close()


# Reads Meshcat's scene on a page: a path's node, whether it is seen, and where it is.
_HELPERS = """
window.node = path => path.split("/").reduce((at, name) => at && at.children[name],
                                             viewer.scene_tree);
window.shown = path => {
    let at = viewer.scene_tree;
    for (const name of path.split("/")) {
        at = at.children[name];
        if (!at || !at.object.visible) return false;
    }
    return true;
};
window.matrix = path => {
    // The root of the tree turns Drake's upward z into that of three.js, y.
    const object = node(path).object;
    object.updateWorldMatrix(true, false);
    const root = viewer.scene.matrixWorld.clone().invert();
    return root.multiply(object.matrixWorld).elements;
};
"""


# For how long tests wait for a page [ms].
PATIENCE = 120_000


class WatchedPage:
    """A page with a list of what went wrong on it and of what it fetched.

    Attributes:
        page: The page, 1280 by 720.
        complaints: Errors on the console and exceptions that nothing caught.
        requests: Addresses that were asked for, the page's own among them.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        # Pages draw with the processor, which others may keep busy; no wait is a test of speed.
        page.set_default_timeout(PATIENCE)
        self.complaints: list[str] = []
        self.requests: list[str] = []
        page.on("console", self._note)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.add_init_script(_HELPERS)

    def open_replay(self, path: Path) -> None:
        """Open a replay without a network."""
        self.page.context.set_offline(True)
        self.page.goto(path.as_uri())
        self.page.wait_for_function("() => viewer.animator.actions.length > 0")

    def seek(self, time: float) -> None:
        """Put a replay at a time [s]; its keys are single floats, so a little later."""
        self.page.evaluate(
            "time => { viewer.animator.pause(); viewer.animator.seek(time + 1e-4); }", time
        )

    def resize(self, width: int, height: int) -> None:
        """Make the page so large, and wait until it has been drawn [px]."""
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.wait_for_function(
            "size => window.innerWidth === size[0] && window.innerHeight === size[1]"
            " && viewer.renderer.domElement.clientWidth === size[0] && !viewer.needs_render",
            arg=[width, height],
        )

    def on_screen(self, points: np.ndarray) -> np.ndarray:
        """Where points of the floor are on the page, shape (n, 2), from its upper left corner [px].

        Args:
            points: Shape (n, 2) [m].
        """
        # A camera is made some time after the page heard of it, and looks anywhere until then.
        self.page.wait_for_function(
            "viewer.camera.type === 'OrthographicCamera' && !viewer.needs_render"
        )
        found = self.page.evaluate(
            """points => points.map(([x, y]) => {
                // With all above them, which a page not drawn since would leave as they were.
                viewer.camera.updateWorldMatrix(true, false);
                viewer.scene.updateWorldMatrix(true, false);
                const at = new MeshCat.THREE.Vector3(x, y, 0);
                const seen = at.applyMatrix4(viewer.scene.matrixWorld).project(viewer.camera);
                const [right, down] = [(seen.x + 1) / 2, (1 - seen.y) / 2];
                return [right * window.innerWidth, down * window.innerHeight];
            })""",
            points.tolist(),
        )
        return np.array(found)

    def _note(self, message) -> None:
        if message.type == "error":
            self.complaints.append(message.text)


@pytest.fixture(scope="module")
def new_page(browser) -> Iterator[Callable[[], WatchedPage]]:
    """A function that opens an empty page in a context of its own, for the tests of a module."""
    contexts = []

    def open_page() -> WatchedPage:
        contexts.append(browser.new_context(viewport=VIEWPORT))
        return WatchedPage(contexts[-1].new_page())

    yield open_page
    for context in contexts:
        context.close()


class MeshcatLog:
    """Stands in for Meshcat where a test asks what was sent and what was recorded.

    Attributes:
        sent: Path and kind of each message that changes what is shown.
        meshes: The mesh last sent to each path: vertices, shape (3, n), and faces, shape (3, m).
        keys: What was recorded: frame to value, by path and name ("pose" for a transform).
    """

    def __init__(self) -> None:
        self.sent: list[tuple[str, str]] = []
        self.meshes: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self.keys: dict[tuple[str, str], dict[int, object]] = {}
        self.recording = False
        self._rate = 0.0

    def SetTriangleMesh(self, path, vertices, faces, rgba) -> None:
        self.sent.append((path, "mesh"))
        self.meshes[path] = (vertices, faces)

    def SetTransform(self, path, pose, time=None) -> None:
        self.sent.append((path, "pose"))
        self._record(time, path, "pose", pose)

    def SetProperty(self, path, name, value, time=None) -> None:
        self.sent.append((path, name))
        self._record(time, path, name, value)

    def _record(self, time, path, name, value) -> None:
        if self.recording and time is not None:
            self.keys.setdefault((path, name), {})[int(time * self._rate)] = value

    def get_mutable_recording(self) -> SimpleNamespace:
        return SimpleNamespace(
            SetTransform=lambda frame, path, pose: self.keys.setdefault((path, "pose"), {}).update(
                {frame: pose}
            ),
            SetProperty=lambda frame, path, name, value: self.keys.setdefault(
                (path, name), {}
            ).update({frame: value}),
        )

    def StartRecording(self, frames_per_second) -> None:
        self.recording = True
        self._rate = frames_per_second

    def StopRecording(self) -> None:
        self.recording = False

    def DeleteRecording(self) -> None:
        self.keys.clear()

    def Delete(self, path) -> None:
        self.meshes = {each: mesh for each, mesh in self.meshes.items() if path not in each}

    def SetCamera(self, camera) -> None:
        self.sent.append(("camera", "camera"))

    def SetCameraPose(self, camera, target) -> None:
        self.sent.append(("camera", "pose"))

    def SetSimulationTime(self, time) -> None:
        """The rate display is no part of the scene."""


@pytest.fixture
def meshcat_log() -> MeshcatLog:
    """A Meshcat that keeps account."""
    return MeshcatLog()

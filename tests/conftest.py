"""What tests of several parts need: programs of the system, and a page in headless Chromium."""

import os
import shutil
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, sync_playwright

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
def browser(require_tool) -> Iterator[Browser]:
    """Headless Chromium with a profile of its own."""
    path = require_tool("chromium", "chromium", "chromium-browser", "google-chrome")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=path, headless=True, args=CHROMIUM_ARGUMENTS
        )
        yield chromium
        chromium.close()


class WatchedPage:
    """A page with a list of what went wrong on it and of what it fetched.

    Attributes:
        page: The page, 1280 by 720.
        complaints: Errors on the console and exceptions that nothing caught.
        requests: Addresses that were asked for, the page's own among them.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.requests: list[str] = []
        page.on("console", self._note)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

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

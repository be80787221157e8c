"""A recorded scene as one web page that plays back without a server or a network."""

import os
import re
import tempfile
from html import escape
from pathlib import Path
from typing import Protocol

from pydrake.geometry import Meshcat

# Meshcat's page fetches each of its commands from a data address, without waiting for the one
# before, so a colour may arrive before the shape that it belongs to. Here they come in order.
_FETCH = re.compile(
    r'fetch\("data:application/octet-binary;base64,([A-Za-z0-9+/=]*)"\)\s*'
    r"\.then\(res => res\.arrayBuffer\(\)\)\s*"
    r"\.then\(buffer => viewer\.handle_command_bytearray\(new Uint8Array\(buffer\)\)\);"
)
# Meshcat keeps the height and the left edge of what an orthographic camera sees, so that a narrow
# page cuts its right edge off. Here such a page shows the whole width, at its bottom: what is left
# free above is where the controls unfold. Wider pages have more room on the right, as before.
SHOW_WHOLE_WORLD = """
    const resize = viewer.set_3d_pane_size.bind(viewer);
    viewer.set_3d_pane_size = (width, height) => {
      const camera = viewer.camera;
      if (camera.type === "OrthographicCamera") {
        camera.asked = camera.asked || {right: camera.right, top: camera.top};
        const across = camera.asked.right - camera.left;
        const up = camera.asked.top - camera.bottom;
        const w = width === undefined ? viewer.dom_element.offsetWidth : width;
        const h = height === undefined ? viewer.dom_element.offsetHeight : height;
        camera.top = camera.bottom + Math.max(up, across * h / w);
      }
      resize(width, height);
    };
"""
_OBEY = """
    function obey(command) {
      const text = atob(command);
      const bytes = new Uint8Array(text.length);
      for (let k = 0; k < text.length; ++k) bytes[k] = text.charCodeAt(k);
      viewer.handle_command_bytearray(bytes);
    }
"""


class RecordedScene(Protocol):
    """What is drawn in a Meshcat that records."""

    @property
    def meshcat(self) -> Meshcat:
        """Where it is drawn."""
        ...

    def finish_recording(self) -> None:
        """End the recording with what was drawn last.

        Raises:
            InvalidInput: Nothing is recorded.
        """
        ...


def write_replay(
    scene: RecordedScene, path: str | os.PathLike[str], *, title: str = "Sightfield"
) -> Path:
    """Write what a scene has recorded to a self-contained HTML file.

    The recording ends here: what the scene draws later is not part of a replay. The file is
    complete or not there at all, since it is written under another name and then moved.

    Args:
        scene: A scene that records, after its run.
        path: Where the page goes; its folder must exist.
        title: Of the page, plain text.

    Returns:
        The path of the page.

    Raises:
        InvalidInput: The scene does not record.
        OSError: The file cannot be written.
    """
    scene.finish_recording()
    scene.meshcat.PublishRecording()
    page = _in_order(scene.meshcat.StaticHtml())
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{escape(title)}</title>", 1)
    target = Path(path)
    handle, draft = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(page)
        # Temporary files are private; a report is meant to be read.
        os.chmod(draft, 0o644)
        os.replace(draft, target)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise
    return target


def _in_order(page: str) -> str:
    """Let a static page of Meshcat obey its commands one after the other, without fetching.

    Before, it learns to show all that an orthographic camera is to show, however narrow it is.
    """
    first = _FETCH.search(page)
    if first is None:
        return page
    head, commands = page[: first.start()], page[first.start() :]
    return head + SHOW_WHOLE_WORLD + _OBEY + _FETCH.sub(r'obey("\1");', commands)

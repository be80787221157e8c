"""A run as one web page that plays back without a server or a network."""

import os
import tempfile
from pathlib import Path

from .scene import TrackingScene

_TITLE = "Sightfield: tracking"


def write_replay(scene: TrackingScene, path: str | os.PathLike[str]) -> Path:
    """Write what a scene has recorded to a self-contained HTML file.

    The recording ends here: what the scene draws later is not part of a replay. The file is
    complete or not there at all, since it is written under another name and then moved.

    Args:
        scene: A scene made with `recording=True`, after its run.
        path: Where the page goes; its folder must exist.

    Returns:
        The path of the page.

    Raises:
        InvalidInput: The scene does not record.
        OSError: The file cannot be written.
    """
    scene.finish_recording()
    scene.meshcat.PublishRecording()
    page = scene.meshcat.StaticHtml().replace(
        "<title>Drake MeshCat</title>", f"<title>{_TITLE}</title>", 1
    )
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

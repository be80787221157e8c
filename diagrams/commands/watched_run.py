"""How a command runs a story: below a bar, on a live page, with a folder of results, or none."""

import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console, RenderableType

from ..outputs import optional_folder
from .shared import progress_bar, tell

if TYPE_CHECKING:
    from pydrake.geometry import Meshcat


class WatchedRun:
    """A run as options ask for it: `opened`, below a `bar`, then `tell` and `stay`."""

    def __init__(self, out: Path | None, *, as_json: bool, meshcat: bool | None, replay: bool):
        """Find out who watches.

        Args:
            out: Folder of the results; None keeps none.
            as_json: Whether standard output is to have one JSON object alone.
            meshcat: Whether to show it live; None: where somebody sits at a terminal.
            replay: Whether results have a replay.
        """
        self.console = Console(stderr=as_json)
        self.attended = sys.stdout.isatty() and sys.stdin.isatty() and not as_json
        self.live = self.attended if meshcat is None else meshcat
        self.recording = out is not None and replay
        self._out, self._as_json = out, as_json

    @contextmanager
    def opened(self, *, steered: bool = False) -> Generator[tuple[Path | None, "Meshcat | None"]]:
        """The folder to write into, and the page to draw on; either may be None.

        A folder that cannot be written is found out before the run, not after it.

        Args:
            steered: Whether somebody takes part on the page, so that there must be one.

        Raises:
            InvalidInput: See `output_folder`.
        """
        with optional_folder(self._out) as folder:
            page = None
            if self.live or self.recording or steered:
                # It loads Drake, for which nonsense among the options should not wait.
                from ..visuals.live_page import open_live_page

                page = open_live_page()
            if self.live and page is not None:
                self.console.print(f"Watch it at [bold]{page.web_url()}[/]")
            yield folder, page

    def bar(self):
        """See `progress_bar`."""
        return progress_bar(self.console, self.attended)

    def tell(self, summary: dict[str, object], written: list[str], *shown: RenderableType) -> None:
        """Print what came out, and what was written.

        Args:
            summary: As JSON.
            written: Names of files.
            shown: Tables and sentences for people.
        """
        tell(summary, *shown, as_json=self._as_json, written=written, out=self._out)

    def stay(self) -> None:
        """Keep the live page while somebody looks at it."""
        if self.live and self.attended:
            self.console.input("The page stays open until you press Enter.")

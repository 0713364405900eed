"""`torc view`: recorded trials in a local page."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from torc.cli.web_page import check_web_libraries, served_page
from torc.episode.viewer_links import VIEWER_PORT


@dataclass(frozen=True)
class ViewCommand:
    """Show recorded trials in a browser, pick by pick: what the planner saw, what it chose and why, what came of it.

    The page is served to this machine only, and needs nothing from outside. Ctrl-C ends it.
    """

    directory: tyro.conf.Positional[Path]
    """A trial (`torc run --out DIR`), or a directory with trials anywhere in it."""
    host: str = "127.0.0.1"
    """Where to listen. Anything but this machine's own addresses makes a token that the browser needs."""
    port: int = VIEWER_PORT
    """0 for any free one."""
    open: bool = False
    """Open the browser."""

    def run(self) -> int:
        """Serve until Ctrl-C."""
        import threading

        check_web_libraries()
        from torc.web.app import Site
        from torc.web.shelf import open_shelf

        shelf = open_shelf(self.directory)
        try:
            with served_page(Site(shelf, shelf), self.host, self.port, self.open):
                threading.Event().wait()
        except KeyboardInterrupt:
            print()
        return 0

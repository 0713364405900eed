"""`torc view`: recorded trials in a local page."""

from dataclasses import dataclass, field
from pathlib import Path

import tyro

from torc.cli.web_page import PageOptions, check_web_libraries, served_page


@dataclass(frozen=True)
class ViewCommand:
    """Show recorded trials in a browser, pick by pick: what the planner saw, what it chose and why, and the outcome.

    The page is served to this machine only, and needs nothing from outside. Ctrl-C ends it.
    """

    directory: tyro.conf.Positional[Path]
    """A trial (`torc run --out DIR`), or a directory with trials anywhere in it."""
    page: PageOptions = field(default_factory=PageOptions)

    def run(self) -> int:
        """Serve until Ctrl-C."""
        import threading

        check_web_libraries()
        from torc.web.app import Site
        from torc.web.shelf import open_shelf

        shelf = open_shelf(self.directory)
        try:
            with served_page(Site(shelf), self.page):
                threading.Event().wait()
        except KeyboardInterrupt:
            print()
        return 0

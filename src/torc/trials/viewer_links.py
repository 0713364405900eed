"""Link to trials in the viewer (`torc view DIR`); links can be written before any viewer runs."""

import hashlib
import re
from pathlib import Path

VIEWER_PORT = 8770
"""The viewer's port unless --port names another one. No link may rely on it."""
REPORT = Path("report/index.html")
"""Default place of the report in a directory of trials; the viewer serves it too."""
PARTIAL = ".partial"
"""End of the name of a trial's directory while it is played."""

_LINK = re.compile(rb'href="#([0-9a-f]{12}/\d+)"')


def trial_key(relative: str) -> str:
    """Return the short name of a trial in addresses, unchanged from while it is played to afterwards.

    It derives from the trial's directory relative to the viewer's, with "/".
    """
    return hashlib.sha256(relative.removesuffix(PARTIAL).encode("utf-8", "surrogateescape")).hexdigest()[:12]


def trial_link(root: Path, directory: Path, pick: int = 0) -> str:
    """Return the link to a pick (counted from 0) of a trial, within the page of a viewer of `root`."""
    return f"#{trial_key(directory.relative_to(root).as_posix())}/{pick}"


def served_links(page: bytes) -> bytes:
    """Point the links of a report at the page of the viewer that serves it."""
    return _LINK.sub(rb'href="/#\1"', page)

"""Where the viewer (`torc view DIR`) shows a trial: links that can be written down before any viewer runs."""

import hashlib
import re
from pathlib import Path

VIEWER_PORT = 8770
"""Where the viewer listens unless --port names another one. No link may count on it."""
REPORT = Path("report/index.html")
"""Where a directory of trials has its report, unless told otherwise; the viewer serves it too."""
PARTIAL = ".partial"
"""The end of the name of a trial's directory while it is played."""

_LINK = re.compile(rb'href="#([0-9a-f]{12}/\d+)"')


def trial_key(relative: str) -> str:
    """Short name of a trial in addresses, by its directory relative to the one that the viewer is given, with "/"; the
    same while it is played and afterwards.
    """
    return hashlib.sha256(relative.removesuffix(PARTIAL).encode("utf-8", "surrogateescape")).hexdigest()[:12]


def trial_link(root: Path, directory: Path, pick: int = 0) -> str:
    """Return the link to a pick (counted from 0) of a trial, within the page of a viewer of `root`."""
    return f"#{trial_key(directory.relative_to(root).as_posix())}/{pick}"


def served_links(page: bytes) -> bytes:
    """Let the links of a report lead to the page of the viewer that serves it."""
    return _LINK.sub(rb'href="/#\1"', page)

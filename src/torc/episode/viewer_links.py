"""Where the viewer (`torc view DIR`) shows a trial: addresses that a page can link to before any viewer runs."""

import hashlib
from pathlib import Path

VIEWER_PORT = 8770
"""Where the viewer listens unless told otherwise, so that links can be written down."""
VIEWER = f"http://127.0.0.1:{VIEWER_PORT}/"
REPORT = Path("report/index.html")
"""Where a directory of trials has its report, unless told otherwise; the viewer serves it too."""
PARTIAL = ".partial"
"""The end of the name of a trial's directory while it is played."""


def trial_key(relative: str) -> str:
    """Short name of a trial in addresses, by its directory relative to the one that the viewer is given, with "/"; the
    same while it is played and afterwards.
    """
    return hashlib.sha256(relative.removesuffix(PARTIAL).encode("utf-8", "surrogateescape")).hexdigest()[:12]


def trial_link(root: Path, directory: Path, pick: int = 0) -> str:
    """The address of a pick (counted from 0) of a trial below `root`, in a viewer of `root` on this machine."""
    return f"{VIEWER}#{trial_key(directory.relative_to(root).as_posix())}/{pick}"

"""The report of a directory of trials, as `torc report` left it there, beside the viewer that its links lead to."""

from pathlib import Path

from torc.episode.viewer_links import REPORT, VIEWER
from torc.errors import InputError
from torc.files.reading import read_bytes

_MAX_BYTES = 128 * 2**20
POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
"""What the page may load: nothing, and no script. It may come from a stranger, with the trials."""


def has_report(root: Path) -> bool:
    """Whether there is one."""
    return (root / REPORT).is_file() and not (root / REPORT.parent).is_symlink()


def report_page(root: Path) -> bytes:
    """The page, its links leading to this server, whatever its host and port. Raises InputError where there is none."""
    if not has_report(root):
        raise InputError(f"There is no report here yet: `torc report {root}` writes it.")
    page = read_bytes(root / REPORT, _MAX_BYTES, "the report")
    return page.replace(f'href="{VIEWER}'.encode(), b'href="/')

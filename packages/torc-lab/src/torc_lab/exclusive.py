"""One torc at a time moves a controller: a second client would throw the first one out in mid-motion."""

import os
import re
import tempfile
from contextlib import suppress
from pathlib import Path

from torc_lab.protocols import LabError

try:
    import fcntl
except ImportError:  # Windows has no flock; torc's own lock is then left out
    fcntl = None  # type: ignore[assignment]


class ControllerLock:
    """A lock on a controller, by its address, among the processes of this machine. The system frees it when its holder
    ends, however that happens.
    """

    def __init__(self, address: str) -> None:
        """Take the lock. Raises LabError if another connection of torc holds it."""
        name = re.sub(r"[^\w.-]", "_", address)
        self._file = _opened(Path(tempfile.gettempdir()) / f"torc-{name}.lock")
        if fcntl is None or self._file is None:
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            holder = os.pread(self._file, 20, 0).decode("ascii", "replace").strip()
            self.release()
            raise LabError(
                f"Another torc (process {holder or 'unknown'}) moves the arm at {address}. A second client would throw "
                "it out in mid-motion: end that one first."
            ) from None
        with suppress(OSError):  # another user's file may be read-only, but can still be locked
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, str(os.getpid()).encode(), 0)

    def release(self) -> None:
        """Free it; may be called twice."""
        if self._file is not None:
            os.close(self._file)
            self._file = None


def _opened(path: Path) -> int | None:
    """A descriptor of the lock's file; None where there can be none, e.g. no room for temporary files."""
    for flags in (os.O_RDWR | os.O_CREAT, os.O_RDONLY):
        with suppress(OSError):
            return os.open(path, flags | getattr(os, "O_CLOEXEC", 0), 0o666)
    return None

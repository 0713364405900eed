"""Let one torc at a time move a controller: a second client would throw the first one out in mid-motion."""

import os
import re
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO

from torc.io.results import try_lock
from torc_lab.protocols import LabError


class ControllerLock:
    """A lock on a controller, by its address, among the processes of this machine.

    The system frees it when its holder ends, in whatever way. It does nothing on systems without flock.
    """

    def __init__(self, address: str) -> None:
        """Take the lock. Raises LabError if another connection of torc holds it."""
        name = re.sub(r"[^\w.-]", "_", address)
        self._file = _opened(Path(tempfile.gettempdir()) / f"torc-{name}.lock")
        if self._file is None:
            return
        locked = try_lock(self._file)
        if locked is None and os.name == "posix":
            self.release()
            raise LabError(
                f"{self._file.name} cannot be locked, so another torc might move the arm at {address}, too. Let the "
                "environment variable TMPDIR name a directory on a local disk."
            )
        if locked is False:
            self._file.seek(0)
            holder = self._file.read(20).strip()
            self.release()
            raise LabError(
                f"Another torc (process {holder or 'unknown'}) moves the arm at {address}. A second client would throw "
                "it out in mid-motion: end that one first."
            )
        with suppress(OSError):  # another user's file may be read-only, but can still be locked
            self._file.truncate(0)
            self._file.write(str(os.getpid()))
            self._file.flush()

    def release(self) -> None:
        """Free it; may be called twice."""
        if self._file is not None:
            self._file.close()


def _opened(path: Path) -> IO[str] | None:
    """Return the lock's file; None if it cannot be opened, e.g. without room for temporary files."""
    for mode in ("a+", "r"):
        with suppress(OSError):
            return open(path, mode, encoding="ascii", errors="replace")  # for its lock
    return None

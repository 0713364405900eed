"""A directory of a process's own that does not outlive it by long, even where the process is killed."""

import contextlib
import os
import shutil
import tempfile
from pathlib import Path
from typing import IO

from torc.records.locks import try_lock

_PREFIX, _UNLOCKED, _LOCK = "torc-ray-", "torc-new-", ".lock"


class Aside:
    """A new directory below the system's temporary one. Making it removes those that killed processes left there.

    A process holds a lock in its directory; the system lets go of it when the process ends, however it does.
    """

    def __init__(self) -> None:
        for left in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
            _remove_if_left(left)
        # It is only looked at by others under its second name, when the lock is held.
        new = Path(tempfile.mkdtemp(prefix=_UNLOCKED))
        self._lock: IO[str] | None = open(new / _LOCK, "w", encoding="utf-8")  # noqa: SIM115  # for life
        try_lock(self._lock)
        self.path = new.with_name(new.name.replace(_UNLOCKED, _PREFIX, 1))
        os.rename(new, self.path)

    def remove(self) -> None:
        """Leave nothing on the disk."""
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        shutil.rmtree(self.path, ignore_errors=True)


def _remove_if_left(directory: Path) -> None:
    # Somebody else may be removing it, or it may be another user's.
    with contextlib.suppress(OSError), open(directory / _LOCK, "r+", encoding="utf-8") as lock:
        if try_lock(lock):  # where there are no locks, what is left stays
            shutil.rmtree(directory, ignore_errors=True)

"""Locks between processes: the system lets go of them when a process ends, however it does."""

from typing import IO, Any


def try_lock(file: IO[Any]) -> bool | None:
    """Locks an open file for this process alone, as long as it is open.

    Returns:
        Whether this process has it now; None where the system or the file system knows no locks.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True

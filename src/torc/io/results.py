"""Results on disk: JSON and directories that exist whole or not at all, and never replace anything else."""

import json
import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from torc.errors import InputError


def write_json(path: Path, data: Any) -> None:
    """Write JSON atomically: a reader sees the whole file or none. Raises OSError if it cannot be written."""
    temporary = path.with_name(path.name + ".tmp")
    with open(temporary, "w", encoding="utf-8") as f:
        json.dump(data, f, indent=2)
        f.write("\n")
        f.flush()
        os.fsync(f.fileno())
    os.replace(temporary, path)


def try_lock(file: IO[Any]) -> bool | None:
    """Lock an open file for this process as long as it is open; the system releases it when the process ends.

    Returns True if this process has the lock now, False if another has it, None where locks are unavailable.
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


def check_place(out: Path, overwrite: bool, mark: str, what: str) -> None:
    """Check that results may go to a directory: a new one, an empty one, or one of their kind, which holds `mark`.

    `what` is the kind in messages, e.g. "trial". Raises InputError if `out` has no name of its own, exists (without
    `overwrite`), or is something else.
    """
    if out.name in ("", ".."):
        raise InputError(
            f"'{out}' cannot become the directory of one {what}: give it a name, e.g. --out runs/mine."
        )
    if not os.path.lexists(out):
        return
    plain = out.is_dir() and not out.is_symlink()
    if not plain or not ((out / mark).is_file() or not any(out.iterdir())):
        raise InputError(f"'{out}' exists and is no {what}, so nothing replaces it. Choose another --out.")
    if not overwrite:
        raise InputError(f"'{out}' exists already. Choose another --out, or add --overwrite to replace it.")


def claim(directory: Path, mark: str, what: str) -> IO[str]:
    """Make a directory anew for this process alone; leftovers of an ended process of that kind are removed.

    Returns the new file `mark`, open for writing: the directory is this process's until it is closed. Raises InputError
    if another process is writing there, it is something else (see `check_place`), or it cannot be written.
    """
    check_place(directory, True, mark, what)
    busy = InputError(f"Another process is writing '{directory}'. Wait for it, or choose another --out.")
    try:
        with suppress(FileNotFoundError), open(directory / mark, "r+", encoding="utf-8") as left:
            if try_lock(left) is False:
                raise busy
            # The mark goes last: if this is interrupted, the rest is still of its kind.
            for inner in directory.iterdir():
                if inner.is_dir() and not inner.is_symlink():
                    shutil.rmtree(inner)
                elif inner.name != mark:
                    inner.unlink()
            shutil.rmtree(directory)
        directory.mkdir(parents=True, exist_ok=True)
        taken = open(directory / mark, "x", encoding="utf-8")  # noqa: SIM115  # for its lock
    except FileExistsError:
        raise busy from None
    except OSError as error:
        raise InputError(f"Cannot write to '{directory}': {error.strerror}. Choose another --out.") from error
    if try_lock(taken) is False:
        raise busy
    return taken

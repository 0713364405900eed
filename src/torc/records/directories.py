"""Directories of results: whole ones, of which nothing else is ever replaced by them."""

import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from torc.errors import InputError


def try_lock(file: IO[Any]) -> bool | None:
    """Locks an open file for this process alone, as long as it is open; the system lets go when a process ends.

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


def check_place(out: Path, overwrite: bool, mark: str, what: str) -> None:
    """Makes sure that results may go to a directory: a new one, an empty one, or one of their own kind.

    Args:
        out: the directory.
        overwrite: results that are there may be replaced.
        mark: a file that each directory of that kind holds.
        what: in messages, e.g. "trial".

    Raises InputError: `out` has no name of its own, exists (and not overwrite), or is something else.
    """
    if out.name in ("", ".."):
        raise InputError(
            f"'{out}' cannot become the directory of one {what}: give it a name, e.g. --out runs/mine."
        )
    _check_kind(out, mark, what)
    if os.path.lexists(out) and not overwrite:
        raise InputError(f"'{out}' exists already. Choose another --out, or add --overwrite to replace it.")


def claim(directory: Path, mark: str, what: str) -> IO[str]:
    """Makes a directory anew, for this process alone; what an ended process left in one of that kind is removed.

    Its parents are made where needed; `mark` and `what` are as for `check_place`.

    Returns:
        The new file `mark`, open for writing: the directory is this process's until it is closed.

    Raises InputError: another process is writing there, it is something else, or it cannot be written.
    """
    _check_kind(directory, mark, what)
    try:
        with suppress(FileNotFoundError), open(directory / mark, "r+", encoding="utf-8") as left:
            _lock(left, directory)
            _remove(directory, mark)
        directory.mkdir(parents=True, exist_ok=True)
        taken = open(directory / mark, "x", encoding="utf-8")  # noqa: SIM115  # for its lock
    except FileExistsError:
        raise _busy(directory) from None
    except OSError as error:
        raise InputError(f"Cannot write to '{directory}': {error.strerror}. Choose another --out.") from error
    _lock(taken, directory)
    return taken


def _check_kind(directory: Path, mark: str, what: str) -> None:
    """Raises InputError for all but a directory that is empty or has the mark. Links are not followed."""
    if not os.path.lexists(directory):
        return
    plain = directory.is_dir() and not directory.is_symlink()
    if not plain or not ((directory / mark).is_file() or not any(directory.iterdir())):
        raise InputError(
            f"'{directory}' exists and is no {what}, so nothing replaces it. Choose another --out."
        )


def _lock(file: IO[str], directory: Path) -> None:
    if try_lock(file) is False:
        raise _busy(directory)


def _busy(directory: Path) -> InputError:
    return InputError(f"Another process is writing '{directory}'. Wait for it, or choose another --out.")


def _remove(directory: Path, mark: str) -> None:
    """The mark goes last: where this is interrupted, what is left is still of its kind."""
    for inner in directory.iterdir():
        if inner.is_dir() and not inner.is_symlink():
            shutil.rmtree(inner)
        elif inner.name != mark:
            inner.unlink()
    (directory / mark).unlink()
    directory.rmdir()

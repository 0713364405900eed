"""Directories of results: whole ones, of which nothing else is ever replaced by them."""

import os
from pathlib import Path

from torc.errors import InputError


def check_place(out: Path, overwrite: bool, mark: str, what: str) -> None:
    """Makes sure that results may go to a directory: a new one, an empty one, or one of their own kind.

    Args:
        out: the directory.
        overwrite: results that are there may be replaced.
        mark: a file that each directory of that kind holds.
        what: in messages, e.g. "trial".

    Raises:
        InputError: `out` has no name of its own, exists (and not overwrite), or is something else.
    """
    if out.name in ("", ".."):
        raise InputError(
            f"'{out}' cannot become the directory of one {what}: give it a name, e.g. --out runs/mine."
        )
    if not os.path.lexists(out):
        return
    if not is_of_kind(out, mark):
        raise InputError(f"'{out}' exists and is no {what}, so nothing replaces it. Choose another --out.")
    if not overwrite:
        raise InputError(f"'{out}' exists already. Choose another --out, or add --overwrite to replace it.")


def is_of_kind(directory: Path, mark: str) -> bool:
    """Whether it is a directory with that file in it, or an empty one. Links are not followed."""
    if directory.is_symlink() or not directory.is_dir():
        return False
    return (directory / mark).is_file() or not any(directory.iterdir())

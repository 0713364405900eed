"""Read files from strangers: plain ones, up to a size."""

import json
import os
import stat
from pathlib import Path
from typing import Any

from torc.errors import InputError


def read_bytes(path: Path, max_bytes: int, what: str) -> bytes:
    """Return the content of a plain file; `what` names it in errors.

    Raises InputError if it is missing, too large, a link, or not a plain file (a device or pipe could be read for
    ever).
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except FileNotFoundError:
        raise InputError(f"{path} is missing: that is {what}.") from None
    except OSError as error:
        if path.is_symlink():
            raise InputError(f"{path} is a link; {what} must be a file of its own. Copy it there.") from None
        raise InputError(f"{path} cannot be read: {error.strerror}.") from None
    with os.fdopen(handle, "rb") as file:
        facts = os.fstat(file.fileno())
        if not stat.S_ISREG(facts.st_mode):
            raise InputError(f"{path} is not a plain file; {what} must be one.")
        if facts.st_size > max_bytes:
            raise InputError(
                f"{path} is too large for {what}: {facts.st_size} bytes; at most {max_bytes} are allowed."
            )
        return file.read(max_bytes + 1)[:max_bytes]


def read_text(path: Path, errors: str = "strict") -> str:
    """Return the text of a UTF-8 file without its byte-order mark, which editors on Windows write.

    `errors` as in `bytes.decode`. Raises OSError and UnicodeDecodeError.
    """
    return path.read_text(encoding="utf-8-sig", errors=errors)


def read_plain_text(path: Path, max_bytes: int, what: str) -> str:
    """Return the text of a plain file, without its byte-order mark; bytes that are not UTF-8 become U+FFFD.

    Raises InputError like `read_bytes`.
    """
    return read_bytes(path, max_bytes, what).decode("utf-8-sig", "replace")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object. Raises InputError."""
    try:
        data = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error
    if not isinstance(data, dict):
        raise InputError(f"{path} must hold a JSON object, not a {type(data).__name__}.")
    return data

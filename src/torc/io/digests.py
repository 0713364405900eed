"""Digests of what decides a result: plain data, files, the code of a part."""

import hashlib
import inspect
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any


def fingerprint(facts: Mapping[str, Any]) -> str:
    """Return the SHA-256 of plain data; the order of keys does not count."""
    text = json.dumps(facts, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def file_fingerprint(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def part_source(maker: Any) -> str:
    """Return the fingerprint of the file that defines a planner; "" if there is none, e.g. for compiled ones.

    Each file is read once per process: imported code does not change when its file does.
    """
    try:
        path = inspect.getsourcefile(maker)
        return _as_first_read(path) if path else ""
    except (TypeError, OSError):
        return ""


@cache
def _as_first_read(path: str) -> str:
    return file_fingerprint(Path(path))


forget_files = _as_first_read.cache_clear
"""Forget what was read, as a new process would."""

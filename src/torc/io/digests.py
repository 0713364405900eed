"""Digests of what decides a result: plain data, files, the code of a part."""

import hashlib
import inspect
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any


def fingerprint(facts: Mapping[str, Any]) -> str:
    """SHA-256 of plain data; the order of keys does not count."""
    text = json.dumps(facts, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def file_fingerprint(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def part_source(maker: Any) -> str:
    """Fingerprint of the file that defines a planner; "" where there is none, e.g. compiled ones.

    Once per file and process: what was imported stays what it is, whatever is written into its file afterwards.
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
"""Read them again, as a new process would."""

"""manifest.json of a store: versions, commit and machine of each call of `torc bench`."""

import json
import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import torc
from torc.episode.versions import versions
from torc.errors import InputError
from torc.io.reading import read_text
from torc.io.results import write_json

MANIFEST_FORMAT = "torc-bench-manifest/1"
_MANIFEST, _GIT_PATIENCE_S = "manifest.json", 10


def begin_call(root: Path, **facts: Any) -> None:
    """Record that a call begins in the store `root`."""
    call = {
        "started": _now(),
        "command": ["torc", *sys.argv[1:]],
        "commit": _commit(Path(torc.__file__).parent),
        "versions": versions(),
        "machine": _machine(),
    }
    write_json(root / _MANIFEST, {"format": MANIFEST_FORMAT, "calls": [*calls(root), call | facts]})


def end_call(root: Path, **facts: Any) -> None:
    """Record how the latest call ended."""
    *before, last = calls(root)
    write_json(
        root / _MANIFEST, {"format": MANIFEST_FORMAT, "calls": [*before, last | {"ended": _now()} | facts]}
    )


def calls(root: Path) -> list[dict[str, Any]]:
    """Return the recorded calls; none without a manifest. Raises InputError."""
    path = root / _MANIFEST
    try:
        return list(json.loads(read_text(path))["calls"]) if path.is_file() else []
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is damaged: {error}. Use another --out.") from None


def _commit(directory: Path) -> dict[str, Any] | None:
    """Return the commit of the checkout that holds a directory, and whether files differ from it; None if there is
    none.
    """

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(directory), *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=_GIT_PATIENCE_S)
        return done.stdout.strip()

    try:
        changed = git("status", "--porcelain", "--untracked-files=no", "--", ".")
        return {"id": git("rev-parse", "HEAD"), "changed": bool(changed)}
    except (OSError, subprocess.SubprocessError):
        return None


def _machine() -> dict[str, Any]:
    processor = platform.machine()
    if (cpuinfo := Path("/proc/cpuinfo")).is_file():
        lines = cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines()
        processor = next((s.split(":", 1)[1].strip() for s in lines if s.startswith("model name")), processor)
    return {"processor": processor, "cores": os.cpu_count(), "system": platform.platform()}


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")

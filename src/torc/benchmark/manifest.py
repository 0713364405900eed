"""What a benchmark ran on: versions, commit, machine. One entry per call of `torc bench` in a store's manifest.json."""

import os
import platform
import subprocess
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import torc
from torc.episode.versions import versions

MANIFEST_FORMAT = "torc-bench-manifest/1"
_GIT_PATIENCE_S = 10


def call_facts(arguments: Sequence[str], workers: int) -> dict[str, Any]:
    """What is known when a call begins with these command-line arguments; `ended_facts` is added when it ends."""
    return {
        "started": _now(),
        "command": ["torc", *arguments],
        "workers": workers,
        "commit": _commit(Path(torc.__file__).parent),
        "versions": versions(),
        "machine": _machine(),
    }


def ended_facts(played: int, errored: int, missing: int) -> dict[str, Any]:
    """How a call ended: trials played by it, errored ones among them, and those still missing in the store."""
    return {"ended": _now(), "played": played, "errored": errored, "missing": missing}


def _commit(directory: Path) -> dict[str, Any] | None:
    """Commit of the checkout that holds a directory, and whether files differ from it; None if there is none."""

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
    """Processor, cores, memory, system."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    named = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    processor = next(named, platform.machine())
    facts: dict[str, Any] = {"processor": processor, "cores": os.cpu_count(), "system": platform.platform()}
    if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        facts["memory_gb"] = round(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9, 1)
    return facts


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")

"""What travels between machines. Light to import: a process that only waits for trials has no more than this."""

import hashlib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import torc
from torc.benchmark.local_pool import PoolConfig
from torc.benchmark.remote.parcel import Parcel
from torc.episode.versions import versions

TorcFacts = tuple[tuple[str, str], ...]
"""Name and value of all that must be the same on all machines."""


@dataclass(frozen=True)
class Luggage:
    """What every machine needs.

    Attributes:
        limits: of a trial, with one process.
        code: Python files of the user's, for planners that lie in the working directory.
        objects: the user's own objects, each in a directory of its name.
        probe: a file that every machine has to see, where its directory has to be shared.
    """

    limits: PoolConfig
    code: Parcel = field(default_factory=Parcel)
    objects: Parcel = field(default_factory=Parcel)
    probe: Path | None = None


@dataclass(frozen=True)
class Errand:
    """A trial to be played elsewhere.

    Attributes:
        key: of the task.
        cargo: the work and its order, pickled: only the child process opens it.
        log: where in the order's directory what is printed goes.
        log_bytes: how much of its end goes back.
        problem: name and content of the problem's file; None for problems that come with torc.
    """

    key: str
    cargo: bytes
    log: str
    log_bytes: int
    problem: tuple[str, bytes] | None = None


@dataclass(frozen=True)
class Returned:
    """How an errand ended.

    Attributes:
        outcome: what the work returned, or a Failure.
        directory: the order's directory, in which it was played.
    """

    outcome: Any
    directory: Parcel


@dataclass(frozen=True)
class Unfit:
    """This machine would play something else than what was sent: why, and the remedy."""

    text: str


@cache
def torc_facts() -> TorcFacts:
    """Versions of what decides results, and torc's files: a version alone does not tell one checkout from another."""
    root, digest = Path(torc.__file__).parent, hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    facts = {k: v for k, v in versions().items() if k != "python"}  # Ray compares that itself
    return (*facts.items(), ("the digest of torc's files", digest.hexdigest()[:12]))

"""Work in one of Ray's processes, on any machine: the local pool plays, and the files go back.

Light to import: only the child process of the local pool loads what a trial needs.
"""

import hashlib
import pickle
import socket
import sys
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torc
from torc.benchmark.local_pool import LocalPool, PoolConfig, Task
from torc.errors import InputError
from torc.trials.versions import versions

CODE = "own-code"
"""The user's Python files, below Ray's working directory."""


def play_remotely(
    pickled: bytes, log: str, limits: PoolConfig, wanted: Mapping[str, str], cache: Path | None
) -> tuple[Any, dict[str, bytes]]:
    """Play an order here; return what the work returned or a Failure, and the files by their paths in its directory.

    `pickled` is the work and its order, which only the child process opens, `log` the path of the task's log, `wanted`
    the sender's `torc_facts`, `cache` a directory for a VLM's replies. Raises InputError if this machine would play
    something else.
    """
    host, here = socket.gethostname(), torc_facts()
    differ = [f"{k} is {here.get(k, 'missing')}, not {v}" for k, v in wanted.items() if here.get(k) != v]
    if differ:
        raise InputError(
            f"On {host} {', '.join(differ)}: results could not be compared. Install the same checkout of torc there "
            "(scripts/setup ray), and start its Ray again."
        )
    if cache is not None and not cache.is_dir():
        raise InputError(
            f"{host} does not see the VLM cache '{cache}'. With Ray a cache has to lie in a directory that all "
            "machines share, by the same path."
        )
    code = str(Path(CODE).absolute())
    if code not in sys.path:
        sys.path.append(code)  # the child process has the same
    # In Ray's working directory: Ray cleans up there what a killed process leaves.
    with TemporaryDirectory(dir=".") as name:
        place = Path(name).absolute()
        (ending,) = _pool(limits).run(_play, [Task("", (pickled, place), place / log)])
        files = {p.relative_to(place).as_posix(): p.read_bytes() for p in place.rglob("*") if p.is_file()}
    failure = ending.failure
    return replace(failure, text=f"On {host}: {failure.text}") if failure else ending.outcome, files


def _play(argument: tuple[bytes, Path]) -> Any:
    """Run the work on its order, with this directory, in the child process."""
    pickled, place = argument
    work, order = pickle.loads(pickled)
    return work(replace(order, work=place))


@cache
def torc_facts() -> dict[str, str]:
    """Return versions of what decides results, and the digest of torc's files, since checkouts may share a version."""
    root, digest = Path(torc.__file__).parent, hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    facts = {k: v for k, v in versions().items() if k != "python"}  # Ray compares that itself
    return {**facts, "the digest of torc's files": digest.hexdigest()[:12]}


@cache
def _pool(limits: PoolConfig) -> LocalPool:
    """Keep the child process for the next trial, since loading what a trial needs takes seconds."""
    return LocalPool(limits, stay=True)

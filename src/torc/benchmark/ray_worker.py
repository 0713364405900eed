"""What happens in a process of Ray's, on whatever machine: the local pool plays, and the files go back.

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
from torc.episode.versions import versions
from torc.errors import InputError

CODE = "own-code"
"""Below Ray's working directory: Python files of the user's."""


def play_remotely(
    pickled: bytes, log: str, limits: PoolConfig, wanted: Mapping[str, str], cache: Path | None
) -> tuple[Any, dict[str, bytes]]:
    """What the work returned or a Failure, and the files of the order's directory by their paths in it.

    Args:
        pickled: the work and its order: only the child process opens it.
        wanted: `torc_facts` of the machine that sends the trial.
        cache: directory that has to be there: replies of a VLM.

    Raises InputError: this machine would play something else.
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
    # In Ray's working directory: what a process that is killed leaves goes when Ray clears that up.
    with TemporaryDirectory(dir=".") as name:
        place = Path(name).absolute()
        (ending,) = _pool(limits).run(_play, [Task("", (pickled, place), place / log)])
        files = {p.relative_to(place).as_posix(): p.read_bytes() for p in place.rglob("*") if p.is_file()}
    failure = ending.failure
    return replace(failure, text=f"On {host}: {failure.text}") if failure else ending.outcome, files


def _play(argument: tuple[bytes, Path]) -> Any:
    """In the child process: the work's answer to its order, with this directory."""
    pickled, place = argument
    work, order = pickle.loads(pickled)
    return work(replace(order, work=place))


@cache
def torc_facts() -> dict[str, str]:
    """Versions of what decides results, and torc's files: a version alone does not tell one checkout from another."""
    root, digest = Path(torc.__file__).parent, hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    facts = {k: v for k, v in versions().items() if k != "python"}  # Ray compares that itself
    return {**facts, "the digest of torc's files": digest.hexdigest()[:12]}


@cache
def _pool(limits: PoolConfig) -> LocalPool:
    """Its child process stays for the next trial, since loading what a trial needs takes seconds."""
    return LocalPool(limits, stay=True)

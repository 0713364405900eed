"""What happens in a process of Ray's, on whatever machine: the local pool plays, and the files go back.

Light to import: only the child process of the local pool loads what a trial needs.
"""

import hashlib
import pickle
import socket
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torc
from torc.benchmark.dispatch import Task
from torc.benchmark.local_pool import LocalPool, PoolConfig
from torc.episode.versions import versions
from torc.errors import InputError

CODE = "own-code"
"""Below Ray's working directory: Python files of the user's."""
_LOG_BYTES = 100_000
"""More than a store keeps of what a trial printed."""


@dataclass(frozen=True)
class Sent:
    """A trial to be played elsewhere.

    Attributes:
        cargo: the work and its order, pickled: only the child process opens it.
        log: name of the file, in the order's directory, that takes what is printed.
        limits: of the trial, with one process.
        torc: `torc_facts` of the machine that sends it.
        cache: directory that has to be there: replies of a VLM.
    """

    cargo: bytes
    log: str
    limits: PoolConfig
    torc: Mapping[str, str]
    cache: Path | None


def play_there(sent: Sent) -> tuple[Any, dict[str, bytes]]:
    """What the work returned or a Failure, and the files of the order's directory by their paths in it.

    Raises:
        InputError: this machine would play something else.
    """
    host = socket.gethostname()
    here = torc_facts()
    differ = [f"{k} is {here.get(k, 'missing')}, not {v}" for k, v in sent.torc.items() if here.get(k) != v]
    if differ:
        raise InputError(
            f"On {host} {', '.join(differ)}: results could not be compared. Install the same checkout of torc there "
            "(scripts/setup ray), and start its Ray again."
        )
    if sent.cache is not None and not sent.cache.is_dir():
        raise InputError(
            f"{host} does not see the VLM cache '{sent.cache}'. With Ray a cache has to lie in a directory that all "
            "machines share, by the same path."
        )
    code = str(Path(CODE).absolute())
    if code not in sys.path:
        sys.path.append(code)  # the child process has the same
    # In Ray's working directory: what a process that is killed leaves goes when Ray clears that up.
    with TemporaryDirectory(dir=".") as name:
        place = Path(name).absolute()
        log = place / sent.log
        (ending,) = _pool(sent.limits).run(play_sent, [Task("", (sent.cargo, place), log)])
        if log.is_file():
            log.write_bytes(log.read_bytes()[-_LOG_BYTES:])
        files = {p.relative_to(place).as_posix(): p.read_bytes() for p in place.rglob("*") if p.is_file()}
    failure = ending.failure
    return replace(failure, text=f"On {host}: {failure.text}") if failure else ending.outcome, files


def play_sent(argument: tuple[bytes, Path]) -> Any:
    """In the child process: the work's answer to its order, with this directory."""
    cargo, place = argument
    work, order = pickle.loads(cargo)
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

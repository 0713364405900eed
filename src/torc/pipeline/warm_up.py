"""The kernels are compiled at their first use (about a minute in all) and cached on disk; here is who says so.

A marker in the user's cache directory, named after the sources and the versions that compile them, tells
whether that has happened already.
"""

import hashlib
import os
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numba

import torc

MESSAGE = "Compiling numerical kernels: about a minute, once; they are cached for the next time."


def kernels_are_cached(use: str = "run") -> bool:
    """Whether these sources were compiled on this machine before, for this use of them."""
    return _marker(use).exists()


@contextmanager
def compiling_once(say: Callable[[str], None], use: str) -> Iterator[bool]:
    """Around the first use of the kernels: says MESSAGE if they must be compiled, and remembers when it is done.

    Yields whether they must be compiled. `use` names what is about to run, since not everything uses all kernels.
    """
    cold = not kernels_are_cached(use)
    if cold:
        say(MESSAGE)
    yield cold
    if cold:
        try:
            _marker(use).parent.mkdir(parents=True, exist_ok=True)
            _marker(use).touch()
        except OSError:
            pass  # a read-only home: the message comes again next time, nothing else


def _marker(use: str) -> Path:
    return cache_directory() / f"kernels-{use}-{_fingerprint()}"


def cache_directory() -> Path:
    """Where torc keeps what can be made again: $XDG_CACHE_HOME/torc, by default ~/.cache/torc."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "torc"


def _fingerprint() -> str:
    sha = hashlib.sha256(f"{numba.__version__} {platform.python_version()} {platform.machine()}".encode())
    for path in sorted(Path(torc.__file__).parent.rglob("*.py")):
        sha.update(str(path).encode())
        sha.update(path.read_bytes())
    return sha.hexdigest()[:16]

"""Report the versions of what decides a trial's result. Light to import."""

import importlib.metadata
import platform
import sys
from collections.abc import Iterable, Mapping
from functools import cache

import torc

_VERSIONED = ("numpy", "scipy", "numba", "mujoco-core")


def versions() -> dict[str, str]:
    """Return the versions of torc, Python, and the libraries that compute."""
    found = {"torc": torc.__version__, "python": platform.python_version(), "platform": sys.platform}
    return found | {name: version for name in _VERSIONED if (version := version_of(name))}


@cache
def version_of(package: str) -> str:
    """Return the version of an installed package; "" if it is missing."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""


def versions_text(found: Mapping[str, str]) -> str:
    """Format versions on one line: "mujoco-core 3.3.7, numpy 2.2.6, ..."."""
    return ", ".join(f"{name} {version}" for name, version in sorted(found.items()))


def differing(texts: Iterable[str]) -> list[str]:
    """Return the entries that not all of these lines share."""
    sets = [set(text.split(", ")) for text in texts]
    return sorted(sets[0].union(*sets) - sets[0].intersection(*sets)) if sets else []

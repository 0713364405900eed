"""Versions of what decides a trial's result. Light to import."""

import importlib.metadata
import platform
import sys

import torc

_VERSIONED = ("numpy", "scipy", "numba", "mujoco-core")


def versions() -> dict[str, str]:
    """Of torc, Python, and the libraries that compute."""
    found = {"torc": torc.__version__, "python": platform.python_version(), "platform": sys.platform}
    for name in _VERSIONED:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found

"""Which compiled kernels there are, and for which types of arguments they are compiled in this process."""

import importlib
import pkgutil
from typing import Any

from numba.core.registry import CPUDispatcher

import torc

_NONE = ("torc.testing.", "torc.cli.")
"""They have none, and some need what is not installed here."""


def all_kernels() -> dict[str, Any]:
    """All kernels that torc uses when it plays or decides, by module and name."""
    found = {}
    for info in pkgutil.walk_packages(torc.__path__, "torc."):
        if info.ispkg or info.name.startswith(_NONE):
            continue
        for name, value in vars(importlib.import_module(info.name)).items():
            if isinstance(value, CPUDispatcher) and value.__module__ == info.name:
                found[f"{info.name}.{name}"] = value
    return found


def all_signatures() -> dict[str, set[Any]]:
    """The types that each kernel is compiled (or loaded) for so far."""
    return {name: set(kernel.signatures) for name, kernel in all_kernels().items()}


def compiled_since(before: dict[str, set[Any]]) -> list[str]:
    """The kernels that had to be compiled, or loaded, for further types since."""
    return sorted(name for name, now in all_signatures().items() if now - before.get(name, set()))

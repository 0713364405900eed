"""Choose a way of rendering that this machine offers.

MuJoCo chooses its GL library when it is imported, from MUJOCO_GL, and fails there if that library is missing; torc
never sets that variable, and makes its contexts itself.
"""

import os
import subprocess
import sys
import threading
from functools import cache
from importlib import import_module
from typing import Any

from torc.errors import InputError, MissingDependencyError

_LIBRARIES = ("egl", "osmesa", "glfw")
BACKENDS = (*_LIBRARIES, "rays")
"""Ways to render: three GL libraries, and ray casting on the processor, which needs none."""
_LIMIT_S = 120
_REMEDY = "apt-get install libegl1 libopengl0 libgl1-mesa-dri   (or: apt-get install libosmesa6)"


@cache
def gl_backend() -> str:
    """Return how this process renders.

    It is MUJOCO_GL if set ("off" means rays), else the first of EGL and OSMesa that works, else rays. Raises InputError
    if MUJOCO_GL names something else.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower().strip()
    if wanted in ("disable", "disabled", "off", "false", "0"):
        return "rays"
    if wanted in _LIBRARIES:
        return wanted
    if wanted not in ("", "enable", "enabled", "on", "true", "1"):
        raise InputError(
            f"MUJOCO_GL is '{wanted}'; torc knows {', '.join(_LIBRARIES)}, off, or leave it unset."
        )
    return next((backend for backend in ("egl", "osmesa") if _works(backend)), "rays")


def make_context(backend: str, width: int, height: int) -> Any:
    """Make a GL context for images up to that size, pixels; with make_current() and free().

    Raises MissingDependencyError if the library is missing or has no device.
    """
    try:
        return import_module(f"mujoco.{backend}").GLContext(width, height)
    except (ImportError, AttributeError, OSError, RuntimeError) as error:
        raise MissingDependencyError(f"Rendering with {backend} ({error})", _REMEDY) from error


class _Spare(threading.local):
    """Unused contexts. Each belongs to the thread that used it."""

    def __init__(self) -> None:
        self.contexts: dict[tuple[str, int, int], list[Any]] = {}


_spare = _Spare()
_MOST_SPARE = 4


def borrow_context(backend: str, width: int, height: int) -> Any:
    """Return a context that this thread used before, with compiled shaders, else a new one from `make_context`."""
    spare = _spare.contexts.get((backend, width, height))
    return spare.pop() if spare else make_context(backend, width, height)


def return_context(context: Any, backend: str, width: int, height: int) -> None:
    """Keep a context for the next borrower in this thread; free it if enough are kept."""
    spare = _spare.contexts.setdefault((backend, width, height), [])
    if len(spare) < _MOST_SPARE:
        spare.append(context)
    else:
        context.free()


def try_drawing() -> tuple[str, str]:
    """Draw a picture as a trial draws, in a process of its own, since a failing GL library can take it along.

    Returns the backend that could draw it, and ""; or "" and why none could.
    """
    command = [sys.executable, "-P", "-c", "from torc.sim.portraits import draw_one; draw_one()"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=_LIMIT_S)
    except subprocess.TimeoutExpired:
        return "", f"no picture within {_LIMIT_S} s"
    if done.returncode == 0:
        return done.stdout.split()[-1], ""  # libraries may print, too
    said = done.stderr.strip().splitlines()
    return "", said[-1] if said else f"the process ended with {done.returncode}"


def _works(backend: str) -> bool:
    """Check whether a context can be made, in another process: a library that fails cannot be exchanged for another."""
    code = f"from mujoco.{backend} import GLContext; GLContext(1, 1)"
    return subprocess.run([sys.executable, "-P", "-c", code], capture_output=True).returncode == 0

"""What the guarded child process is told to do in the tests."""

import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from torc.errors import InputError


def answer(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    (directory / "left.txt").write_text("here")
    return {"twice": 2 * request["number"]}


def refuse(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    raise InputError("Not like this.")


def fail(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    raise KeyError("inner fault")


def hang(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    # A child of its own must not outlive it either.
    if os.fork() == 0:
        time.sleep(600)
    (directory / "pid.txt").write_text(str(os.getpid()))
    time.sleep(600)
    return {}


def spin(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    while True:
        pass


def eat(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    return {"size": len([np.ones(2**27) for _ in range(64)])}


def die(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    os.abort()


def leave(request: dict[str, Any], directory: Path) -> dict[str, Any]:
    sys.exit(7)

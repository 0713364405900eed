"""Signals that ask a program to end: Ctrl-C, and those of a closed terminal or an init system."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")


@contextmanager
def ended_like_ctrl_c() -> Iterator[None]:
    """Make SIGTERM and SIGHUP raise KeyboardInterrupt like Ctrl-C inside the block.

    Ctrl-C does so even if a parent process ignores it, as under nohup or in the background of a script. An ignored
    SIGHUP stays ignored: nohup asks for that. Does nothing outside the main thread.
    """
    with _handled(lambda name, was: not (name == "SIGHUP" and was is signal.SIG_IGN), _interrupt):
        yield


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Hold these signals back during the block, which must be short; the first of them is delivered at its end."""
    waiting: list[int] = []
    try:
        with _handled(lambda name, was: callable(was), lambda number, frame: waiting.append(number)):
            yield
    finally:
        if waiting:
            signal.raise_signal(waiting[0])


def _interrupt(number: int, frame: FrameType | None) -> None:
    if number == getattr(signal, "SIGHUP", None):
        # The terminal is gone: anything printed from now on would fail.
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError, AttributeError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    raise KeyboardInterrupt


@contextmanager
def _handled(wanted: Any, handler: Any) -> Iterator[None]:
    """Handle those signals during the block for which `wanted(name, handler now)` is true."""
    before: dict[int, Any] = {}
    for name in _NAMES if threading.current_thread() is threading.main_thread() else ():
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        was = None if number is None else signal.getsignal(number)
        if number is not None and was is not None and wanted(name, was):  # None: not set by Python code
            before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        for number, was in before.items():
            signal.signal(number, was)

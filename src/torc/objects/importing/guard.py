"""Child processes for work on hostile files: a hang, a crash or too much memory ends the child, not the parent.

The two sides exchange files in a directory, never pickles; what the child made is validated like a stranger's.
"""

import contextlib
import importlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from math import ceil
from pathlib import Path
from typing import Any

from torc.errors import InputError, TorcError

_REQUEST, _ANSWER, _LOG = "request.json", "answer.json", "log.txt"
_MAX_FILE_BYTES = 2**30
# One seed for sets of text, few threads and heaps: the same answer on every machine, within the memory allowed.
_ENVIRONMENT = {
    "PYTHONHASHSEED": "0",
    "OMP_NUM_THREADS": "2",
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "2",
}


class ChildError(TorcError):
    """The child process ended without an answer; the text says how."""


def run_child(
    task: str, request: Mapping[str, Any], directory: Path, limit_s: float, memory_bytes: int
) -> dict[str, Any]:
    """What `task` ("module:function", called with the request and the directory) returns in a child process.

    Args:
        task: a function that takes (request, directory) and returns plain data.
        request: plain data.
        directory: where both sides put their files.
        limit_s: computing time (of all cores together) after which the child is ended. After four times that on the
            clock it is killed too, with all that it started: a busy machine needs longer, a hanging child for ever.
        memory_bytes: its address space, where the system can limit that.

    Raises:
        InputError: the function raised one.
        ChildError: time or memory ran out, or the process crashed.
    """
    order = {"task": task, "memory_bytes": memory_bytes, "cpu_s": ceil(limit_s), "request": dict(request)}
    (directory / _REQUEST).write_text(json.dumps(order), encoding="utf-8")
    code = _run(directory, 4 * limit_s)
    if code in (None, -signal.SIGXCPU):
        raise ChildError(f"it took longer than {limit_s:g} s of computing")
    try:
        answer = json.loads((directory / _ANSWER).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        signals = {-s.value: s.name for s in signal.Signals}
        how = f"was ended by {signals[code]}" if code in signals else f"ended with code {code} and no answer"
        raise ChildError(f"the process {how}") from None
    if "refused" in answer:
        raise InputError(answer["refused"])
    if "failed" in answer:
        raise ChildError(answer["failed"])
    return dict(answer["result"])


def _run(directory: Path, timeout_s: float) -> int | None:
    """The child's exit code, or None if the time was up."""
    with open(directory / _LOG, "wb") as log:
        child = subprocess.Popen(
            # -P: nothing is imported from the working directory, which may be a stranger's too
            [sys.executable, "-P", "-m", __name__, str(directory)],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            env={**os.environ, **_ENVIRONMENT},
            start_new_session=True,
        )
        try:
            return child.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return None
        finally:  # it ends, and whatever it started
            if hasattr(os, "killpg"):
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.killpg(child.pid, signal.SIGKILL)
            child.kill()
            child.wait()


def _serve(directory: Path) -> None:
    """The child's side."""
    order = json.loads((directory / _REQUEST).read_text(encoding="utf-8"))
    _limit(order["memory_bytes"], order["cpu_s"])
    answer: dict[str, Any]
    try:
        module, function = order["task"].split(":")
        answer = {"result": getattr(importlib.import_module(module), function)(order["request"], directory)}
    except InputError as error:
        answer = {"refused": str(error)}
    except MemoryError:
        answer = {"failed": f"it needed more memory than {order['memory_bytes'] / 2**30:.1f} GB"}
    except Exception as error:  # third-party code on hostile files: anything may come
        answer = {"failed": f"{type(error).__name__}: {str(error)[:300]}"}
    (directory / _ANSWER).write_text(json.dumps(answer), encoding="utf-8")


def _limit(memory_bytes: int, cpu_s: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows; the time-out holds there too
        return
    for kind, limit in (
        (resource.RLIMIT_AS, memory_bytes),
        (resource.RLIMIT_CPU, cpu_s),
        (resource.RLIMIT_FSIZE, _MAX_FILE_BYTES),
        (resource.RLIMIT_CORE, 0),
    ):
        with contextlib.suppress(ValueError, OSError):  # macOS knows some of them by name only
            _, hard = resource.getrlimit(kind)
            resource.setrlimit(kind, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))


if __name__ == "__main__":
    _serve(Path(sys.argv[1]))

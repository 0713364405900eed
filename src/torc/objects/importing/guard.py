"""Child processes for work on hostile files: a hang, a crash or too much memory ends the child, not the parent.

The two sides exchange files in a directory, never pickles; whatever the child wrote is validated like a stranger's.
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
_MAX_ANSWER_BYTES = 1_000_000
_MAX_FILE_BYTES = 2**30


class ChildError(TorcError):
    """The child process ended without an answer; the text says how."""


def run_child(
    task: str, request: Mapping[str, Any], directory: Path, limit_s: float, memory_bytes: int
) -> dict[str, Any]:
    """Runs `task` ("module:function", called with the request and the directory) in a child process.

    Args:
        task: a function that takes (request, directory) and returns plain data.
        request: plain data.
        directory: where both sides put their files.
        limit_s: computing time (of all cores together) after which the child is ended. After four times that on the
            clock it is killed too, with all that it started: a busy machine needs longer, a hanging child for ever.
        memory_bytes: its address space, where the system can limit that.

    Returns:
        What the function returned.

    Raises:
        InputError: the function raised one.
        ChildError: time or memory ran out, or the process crashed.
    """
    order = {
        "task": task,
        "memory_bytes": memory_bytes,
        "cpu_s": ceil(limit_s),
        "request": dict(request),
    }
    (directory / _REQUEST).write_text(json.dumps(order), encoding="utf-8")
    # -P: nothing is imported from the working directory, which may be a stranger's too
    code = _run([sys.executable, "-P", "-m", __name__, str(directory)], directory, 4 * limit_s)
    if code in (None, -signal.SIGXCPU):
        raise ChildError(f"it took longer than {limit_s:g} s of computing")
    answer = _read_answer(directory / _ANSWER)
    if answer is None:
        raise ChildError(_death(code))
    if "refused" in answer:
        raise InputError(str(answer["refused"]))
    if "failed" in answer:
        raise ChildError(str(answer["failed"]))
    result = answer.get("result")
    return result if isinstance(result, dict) else {}


def _run(command: list[str], directory: Path, timeout_s: float) -> int | None:
    """Exit code, or None if the time was up."""
    # One seed for sets of text, few threads and heaps: the same answer on every machine, within the memory allowed.
    quiet = {
        "PYTHONHASHSEED": "0",
        "OMP_NUM_THREADS": "2",
        "OPENBLAS_NUM_THREADS": "1",
        "MALLOC_ARENA_MAX": "2",
    }
    with open(directory / _LOG, "wb") as log:
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            env={**os.environ, **quiet},
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


def _read_answer(path: Path) -> dict[str, Any] | None:
    try:
        if path.is_symlink() or path.stat().st_size > _MAX_ANSWER_BYTES:
            return None
        answer = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return answer if isinstance(answer, dict) else None


def _death(code: int | None) -> str:
    signals = {-s.value: s.name for s in signal.Signals}
    if code in signals:
        return f"the process was ended by {signals[code]}"
    return f"the process ended with code {code} and no answer"


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
    except RecursionError:
        answer = {"failed": "it is nested too deeply"}
    except Exception as error:  # third-party code on hostile files: anything may come
        answer = {"failed": f"{type(error).__name__}: {str(error)[:300]}"}
    aside = directory / f"{_ANSWER}.tmp"
    aside.write_text(json.dumps(answer), encoding="utf-8")
    aside.replace(directory / _ANSWER)


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

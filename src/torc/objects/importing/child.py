"""The child process that makes an object of a stranger's mesh file, within limits of time and memory.

It is given a directory with the request, and leaves its answer and the object there; never pickles.
"""

import contextlib
import json
import sys
from collections.abc import Mapping
from math import ceil
from pathlib import Path
from typing import Any

from torc.errors import InputError
from torc.objects.importing.mesh import ANSWER_FILE, REQUEST_FILE

_MAX_FILE_BYTES = 2**30


def answer(request: Mapping[str, Any], directory: Path) -> dict[str, Any]:
    """The notes of `make_object`, or why there is no object."""
    from torc.objects.importing.making import make_object

    try:
        return {"notes": make_object(request, directory)}
    except InputError as error:
        return {"refused": str(error)}
    except MemoryError:
        return {"failed": "it needed more memory than is allowed"}
    except Exception as error:  # third-party code on hostile files: anything may come
        return {"failed": f"{type(error).__name__}: {str(error)[:300]}"}


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
            resource.setrlimit(kind, (limit, resource.getrlimit(kind)[1]))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    order = json.loads((folder / REQUEST_FILE).read_text(encoding="utf-8"))
    _limit(order["memory_bytes"], ceil(order["limit_s"]))
    (folder / ANSWER_FILE).write_text(json.dumps(answer(order, folder)), encoding="utf-8")

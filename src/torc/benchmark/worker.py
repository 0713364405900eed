"""What happens inside a process that works for the local pool."""

import contextlib
import faulthandler
import io
import os
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from torc.benchmark.dispatch import Failure, FailureKind, Work
from torc.errors import TorcError
from torc.processes import end_with


def set_up(memory_bytes: int | None, parent: int) -> None:
    """Called once in every worker: a bound on the address space, and no life without the parent process."""
    end_with(parent)
    if memory_bytes is None:
        return
    with contextlib.suppress(ImportError, ValueError, OSError):  # Windows has no limit, macOS by name only
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def carry_out(work: Work, argument: Any, log: Path, limit_s: float) -> Any:
    """The answer of the work, or the Failure of what it raised: strangers' exceptions may not survive the way back.

    All that it prints, natively too, goes to the log, and so do the tracebacks of crashes.
    """
    with _output_to(log):
        faulthandler.enable()
        # Shortly before the pool ends a process that hangs: the log tells where it hung.
        faulthandler.dump_traceback_later(max(0.5 * limit_s, limit_s - 5.0))
        try:
            return work(argument)
        except (Exception, SystemExit) as error:  # somebody's code: anything may come
            traceback.print_exc()
            if isinstance(error, MemoryError):
                return Failure(FailureKind.MEMORY, "It asked for more memory than it may have.")
            text = str(error) if isinstance(error, TorcError) else f"{type(error).__name__}: {error}"
            return Failure(FailureKind.RAISED, text)
        finally:
            faulthandler.cancel_dump_traceback_later()


@contextlib.contextmanager
def _output_to(path: Path) -> Iterator[None]:
    """Standard output and errors of the process into a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    kept = os.dup(1), os.dup(2)
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Python keeps back what is not printed to a terminal: a crash would swallow it.
        sys.stdout.reconfigure(line_buffering=True)
    with open(path, "ab", buffering=0) as log:
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
        try:
            yield
        finally:
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(OSError, ValueError):
                    stream.flush()
            os.dup2(kept[0], 1)
            os.dup2(kept[1], 2)
            os.close(kept[0])
            os.close(kept[1])

"""A task that crashes, hangs, eats memory or raises costs only itself. Real processes."""

import sys
import time

import pytest

from torc.benchmark.local_pool import FailureKind, LocalPool, PoolConfig, Task
from torc.errors import UnknownNameError

LIMIT_S = 2.0


def work(what: str) -> str:
    """Light to import in the processes of the pool."""
    import ctypes
    import os

    print(f"{what} begins")
    match what:
        case "segfaults":
            ctypes.string_at(0)
        case "aborts":
            os.abort()
        case "hangs":
            time.sleep(3600)
        case "eats memory":
            bytearray(2**45)
        case "raises":
            raise UnknownNameError("thing", "x", ["y"])  # cannot be unpickled
        case "exits":
            sys.exit(3)
    return f"{what} {os.environ['OMP_NUM_THREADS']}"


KINDS = ("one", "segfaults", "two", "aborts", "hangs", "eats memory", "raises", "exits", "three")


@pytest.fixture(scope="module")
def endings(tmp_path_factory):
    """What came of every kind of task, and their logs."""
    logs = tmp_path_factory.mktemp("logs")
    pool = LocalPool(PoolConfig(1, LIMIT_S, 4 * 2**30))
    ended = {e.key: e for e in pool.run(work, [Task(k, k, logs / k) for k in KINDS])}
    return ended, {k: (logs / k).read_text() for k in KINDS}


def test_every_task_ends_once(endings):
    assert sorted(endings[0]) == sorted(KINDS)


@pytest.mark.parametrize("kind", ["one", "two", "three"])
def test_the_others_answer_with_one_thread_each(endings, kind):
    assert endings[0][kind].outcome == f"{kind} 1"
    assert endings[0][kind].failure is None


@pytest.mark.parametrize(
    ("kind", "failure", "said", "logged"),
    [
        ("segfaults", FailureKind.CRASHED, "SIGSEGV", "string_at"),
        ("aborts", FailureKind.CRASHED, "SIGABRT", "Aborted"),
        ("hangs", FailureKind.HUNG, "2 s", "in work"),
        ("eats memory", FailureKind.MEMORY, "memory", "MemoryError"),
        ("raises", FailureKind.RAISED, "Unknown thing 'x'", "UnknownNameError"),
        ("exits", FailureKind.RAISED, "SystemExit: 3", "SystemExit"),
    ],
)
def test_a_failure_says_what_happened_and_where(endings, kind, failure, said, logged):
    found = endings[0][kind].failure
    assert found.kind is failure
    assert said in found.text
    assert endings[1][kind].startswith(f"{kind} begins")
    assert logged in endings[1][kind]

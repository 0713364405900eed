"""A task that crashes, hangs, eats memory or raises costs only itself. Real processes."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from torc.benchmark.dispatch import FailureKind, Task
from torc.benchmark.local_pool import LocalPool, PoolConfig
from torc.errors import UnknownNameError

LIMIT_S = 2.0


def work(what: str) -> str:
    """Light to import in the processes of the pool."""
    import ctypes
    import faulthandler
    import os

    print(f"{what} begins")
    match what:
        case "segfaults":
            ctypes.string_at(0)
        case "aborts":
            os.abort()
        case "hangs":
            time.sleep(3600)
        case "dies of the dump":
            os.write(1, b"an unfinished line ")
            faulthandler.dump_traceback_later(0.01)
            time.sleep(0.5)
            ctypes.string_at(0)
        case "eats memory":
            bytearray(2**45)
        case "raises":
            raise UnknownNameError("thing", "x", ["y"])  # cannot be unpickled
        case "exits":
            sys.exit(3)
    return f"{what} {os.environ['OMP_NUM_THREADS']}"


KINDS = (
    "one",
    "segfaults",
    "two",
    "aborts",
    "hangs",
    "dies of the dump",
    "eats memory",
    "raises",
    "exits",
    "three",
)


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
        ("dies of the dump", FailureKind.HUNG, "2 s", "in work"),
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


def test_what_an_earlier_try_left_in_the_log_does_not_count(tmp_path):
    (tmp_path / "log").write_text("Timeout (0:00:01)!\n")
    pool = LocalPool(PoolConfig(1, 20.0))
    (ending,) = pool.run(work, [Task("again", "segfaults", tmp_path / "log")])
    assert ending.failure.kind is FailureKind.CRASHED
    assert (tmp_path / "log").read_text().startswith("Timeout (0:00:01)!\nsegfaults begins")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere they end when they let another thread run")
def test_processes_end_with_a_runner_that_is_killed(tmp_path):
    script = tmp_path / "runner.py"
    script.write_text(
        textwrap.dedent(
            """
            import os, re, sys
            from pathlib import Path

            def work(path):
                Path(path).write_text(str(os.getpid()))
                re.match("(a+)+$", 64 * "a" + "b")  # for ever, and no other thread gets a turn

            if __name__ == "__main__":
                from torc.benchmark.dispatch import Task
                from torc.benchmark.local_pool import LocalPool, PoolConfig
                task = Task("t", sys.argv[1], Path(sys.argv[1] + ".log"))
                list(LocalPool(PoolConfig(1, 600.0)).run(work, [task]))
            """
        )
    )
    told = tmp_path / "pid"
    runner = subprocess.Popen([sys.executable, str(script), str(told)])
    try:
        _wait(lambda: told.exists() and told.read_text())
    finally:
        runner.kill()
        runner.wait()
    pid = told.read_text()
    try:
        _wait(lambda: not _alive(pid))
    finally:
        if _alive(pid):
            os.kill(int(pid), signal.SIGKILL)


def _alive(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as f:
            return f.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def _wait(done):
    end = time.monotonic() + 30
    while not done():
        assert time.monotonic() < end
        time.sleep(0.02)

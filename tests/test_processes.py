"""Child processes that share the cores use one thread each, and end with their parent."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import cv2
import pytest

from torc.errors import TorcError
from torc.processes import one_thread_each, open_pool, threads


def _threads() -> str | None:
    return os.environ.get("OPENBLAS_NUM_THREADS")


def _threads_for_drawing() -> str | None:
    return os.environ.get("LP_NUM_THREADS")


def test_children_are_told_and_the_parent_is_as_before(monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")

    def ask_child_and_fail():
        with one_thread_each(), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            assert pool.submit(_threads).result(timeout=60) == "1"
            assert pool.submit(_threads_for_drawing).result(timeout=60) == "0"
            raise KeyError

    with pytest.raises(KeyError):
        ask_child_and_fail()
    assert (_threads(), os.environ["OMP_NUM_THREADS"]) == (None, "3")


def test_a_worker_uses_one_thread_and_its_parent_one_per_core(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    with open_pool(1) as pool:
        assert pool.submit(threads).result(timeout=60) == 1
        assert pool.submit(cv2.getNumThreads).result(timeout=60) == 1
    assert 1 <= threads() <= os.cpu_count()


@pytest.mark.parametrize(("given", "used"), [("3", 3), ("0", 1)])
def test_the_number_of_threads_can_be_given(monkeypatch, given, used):
    monkeypatch.setenv("OMP_NUM_THREADS", given)
    assert threads() == used


def _end_itself(how: int) -> None:
    os.kill(os.getpid(), how)


def test_a_worker_that_is_killed_is_said_with_the_remedy():
    with pytest.raises(TorcError, match="fewer --workers"), open_pool(1) as pool:
        list(pool.map(_end_itself, [signal.SIGKILL]))


_PARENT = """
import os, time
from torc.processes import open_pool

if __name__ == "__main__":
    with open_pool(2) as pool:
        print(*{pool.submit(os.getpid).result() for _ in range(20)}, flush=True)
        time.sleep(600)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_workers_end_with_a_parent_that_is_killed(tmp_path):
    (tmp_path / "parent.py").write_text(_PARENT)
    command = [sys.executable, tmp_path / "parent.py"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as parent:
        workers = parent.stdout.readline().split()
        parent.kill()
    assert workers
    for _ in range(600):
        if not any(os.path.exists(f"/proc/{worker}") for worker in workers):
            return
        time.sleep(0.1)
    raise AssertionError("They are still there.")

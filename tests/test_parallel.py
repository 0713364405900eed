"""Independent work in threads: the same results in the same order, whatever the number of threads."""

import os
import threading

import numpy as np
import pytest

from torc.parallel import by_rows, each


@pytest.fixture(params=["1", "3"], autouse=True)
def threads(request, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", request.param)
    return int(request.param)


def test_results_come_in_the_order_of_the_items(threads):
    used = set()

    def squared(k: int) -> int:
        used.add(threading.current_thread().name)
        return k * k

    assert each(squared, range(50)) == [k * k for k in range(50)]
    assert (threading.current_thread().name in used) == (threads == 1)
    assert each(squared, []) == []


def test_work_within_work_does_not_wait_for_itself():
    assert each(lambda k: sum(each(lambda m: m + k, range(20))), range(20)) == [
        190 + 20 * k for k in range(20)
    ]


def test_what_one_item_raises_comes_out():
    with pytest.raises(ZeroDivisionError):
        each(lambda k: 1 / (k - 7), range(20))
    assert each(lambda k: k, range(3)) == [0, 1, 2]


@pytest.mark.parametrize(("rows", "least"), [(0, 8), (1, 1), (7, 2), (100, 8), (100, 200)])
def test_every_row_is_worked_on_once(rows, least, threads):
    given, done = np.arange(rows), np.zeros(rows)
    calls = []

    def kernel(numbers, out, factor):
        calls.append(len(numbers))
        out += factor * numbers + 1

    by_rows(kernel, (given, done), 2.0, least=least)
    np.testing.assert_array_equal(done, 2.0 * given + 1)
    assert sum(calls) == rows
    assert len(calls) == 1 or min(calls) >= least
    assert threads > 1 or len(calls) == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_gets_threads_of_its_own():
    each(lambda k: k, range(9))
    if (child := os.fork()) == 0:
        os._exit(0 if each(lambda k: k, range(9)) == list(range(9)) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_several_threads_ask_at_once():
    found = [None] * 6

    def ask(n: int) -> None:
        found[n] = each(lambda k: k + n, range(40))

    asking = [threading.Thread(target=ask, args=(n,)) for n in range(6)]
    for thread in asking:
        thread.start()
    for thread in asking:
        thread.join()
    assert found == [[k + n for k in range(40)] for n in range(6)]

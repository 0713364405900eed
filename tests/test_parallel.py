"""Independent work in threads: the same results in the same order, whatever the number of threads."""

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

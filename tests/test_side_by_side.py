"""Work that is spread over threads gives what it gives in one."""

import threading

import numpy as np
import pytest

from torc.side_by_side import shares, side_by_side


@pytest.fixture(params=["1", "3", "40"])
def given(request, monkeypatch):
    """The number of threads that a process may use."""
    monkeypatch.setenv("OMP_NUM_THREADS", request.param)
    return int(request.param)


def test_results_keep_their_order(given):
    assert side_by_side(lambda n: n * n, range(20)) == [n * n for n in range(20)]
    assert side_by_side(str, []) == []


def test_an_exception_passes_through(given):
    with pytest.raises(ZeroDivisionError):
        side_by_side(lambda n: 1 / n, [2, 1, 0])


def test_items_are_worked_on_at_once_and_a_worker_stays_in_its_thread(monkeypatch):
    meeting = threading.Barrier(2, timeout=30)
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    side_by_side(lambda _: meeting.wait(), range(2))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert set(side_by_side(lambda _: threading.get_ident(), range(5))) == {threading.get_ident()}


@pytest.mark.parametrize("n", [0, 1, 2, 39, 1000])
def test_shares_are_every_row_once_and_about_equally_many(given, n):
    parts = [np.arange(n)[part] for part in shares(n)]
    assert np.concatenate([np.zeros(0, int), *parts]).tolist() == list(range(n))
    assert len(parts) == min(given, n)
    assert not parts or max(map(len, parts)) - min(map(len, parts)) <= 1

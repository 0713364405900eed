"""Plays what is missing or errored in a store, and tells how it goes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from torc.benchmark.dispatch import Backend, Task, Work
from torc.benchmark.playing import OUTPUT, Order, play
from torc.benchmark.spec import BenchSpec, PlannedTrial
from torc.benchmark.store import Store
from torc.vlm.cache import CacheConfig


@dataclass(frozen=True)
class Played:
    """A trial has ended: completed or errored, as its result.json says."""

    trial: PlannedTrial
    result: dict[str, Any]

    @property
    def completed(self) -> bool:
        """It counts."""
        return self.result.get("status") == "completed"


Listener = Callable[[Played], Any]


def run_missing(
    store: Store,
    spec: BenchSpec,
    backend: Backend,
    *,
    limit: int | None = None,
    vlm_cache: CacheConfig | None = None,
    listener: Listener = lambda played: None,
    work: Work = play,
) -> int:
    """Play what is missing or errored; how many were errored.

    Whenever this is stopped, even killed, the store holds whole trials only, and calling it again goes on.

    Args:
        store: where the trials are; the caller has locked it.
        spec: what is wanted.
        backend: who plays.
        limit: play at most so many.
        vlm_cache: where replies of a VLM are kept.
        listener: told of every trial that has ended.
        work: what plays an `Order`, in a process of the backend's.
    """
    orders = {
        trial.id: Order(trial, store.problem_path(trial.problem), store.work(trial), vlm_cache)
        for trial in store.left(spec)[:limit]
    }
    errored = 0
    for ending in backend.run(work, [Task(key, order, order.work / OUTPUT) for key, order in orders.items()]):
        order = orders[ending.key]
        played = Played(order.trial, store.accept(order.trial, order.work, ending.failure))
        errored += not played.completed
        listener(played)
    return errored

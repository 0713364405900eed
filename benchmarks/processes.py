"""Jobs over several processes of one thread each, for the benchmarks that solve."""

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from torc.benchmark.local_pool import LocalPool, PoolConfig, Task

LIMIT_S = 24 * 3600.0


def run_jobs(work: Callable[..., str], jobs: Sequence[tuple], workers: int) -> None:
    """Calls `work(*job)` for each job and prints the line that it returns, or why there is none, as jobs end."""
    pool = LocalPool(PoolConfig(workers, LIMIT_S, None))
    with tempfile.TemporaryDirectory() as logs:
        tasks = [Task(str(i), (work, job), Path(logs) / f"{i}.txt") for i, job in enumerate(jobs)]
        for done, ending in enumerate(pool.run(call, tasks), start=1):
            failure = ending.failure
            line = (
                ending.outcome
                if failure is None
                else f"{jobs[int(ending.key)]}: {failure.kind}: {failure.text}"
            )
            print(f"[{done}/{len(jobs)}] {line}", flush=True)


def call(order: tuple[Callable[..., str], tuple]) -> str:
    """In a process of the pool."""
    work, job = order
    return work(*job)

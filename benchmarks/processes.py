"""Jobs over several processes of one thread each, for the benchmarks that play and solve."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context


def run_jobs(work: Callable[..., str], jobs: Sequence[tuple], workers: int) -> None:
    """Calls `work(*job)` for each job and prints the line that it returns, as jobs end."""
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", NUMBA_NUM_THREADS="1")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        futures = [pool.submit(work, *job) for job in jobs]
        for i, future in enumerate(as_completed(futures)):
            print(f"[{i + 1}/{len(jobs)}] {future.result()}", flush=True)

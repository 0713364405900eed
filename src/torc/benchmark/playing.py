"""Play missing and errored trials of a store, each in a worker process, and show the progress."""

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from torc.benchmark.local_pool import Backend, Task, Work
from torc.benchmark.spec import BenchSpec, PlannedTrial, problem_fingerprint
from torc.benchmark.store import OUTPUT, TRIAL, Store
from torc.errors import InputError
from torc.io.digests import part_source
from torc.pipeline.building import sources
from torc.pipeline.planners import load_planner
from torc.problems.problem import load_problem
from torc.trials.log import TrialResult
from torc.trials.trial import Recording, run_trial
from torc.vlm.cache import CacheConfig


@dataclass(frozen=True)
class Order:
    """A worker's order: `problem` is a name or path, `work` the directory to play in, `pictures` as in `Recording`."""

    trial: PlannedTrial
    problem: str
    work: Path
    vlm_cache: CacheConfig | None = None
    pictures: bool = True


Listener = Callable[[PlannedTrial, TrialResult], Any]
"""Receives a trial that has ended, and its result."""


def run_missing(
    store: Store,
    spec: BenchSpec,
    backend: Backend,
    *,
    limit: int | None = None,
    vlm_cache: CacheConfig | None = None,
    pictures: bool = True,
    listener: Listener = lambda trial, result: None,
    work: Work | None = None,
) -> None:
    """Play missing and errored trials of a store that the caller has locked.

    Whenever this is stopped, even killed, the store holds only whole trials, and the next call continues. `limit` is
    the most trials to play; `pictures` is as in `Recording`; `work`, by default `play`, plays an `Order` in a process
    of the backend.
    """
    orders = {
        trial.id: Order(trial, store.problem_path(trial.problem), store.work(trial), vlm_cache, pictures)
        for trial in store.left(spec)[:limit]
    }
    tasks = [Task(key, order, order.work / OUTPUT) for key, order in orders.items()]
    for ending in backend.run(work or play, tasks):
        order = orders[ending.key]
        listener(order.trial, store.accept(order.trial, order.work, ending.failure))


def changed_part(trial: PlannedTrial) -> str | None:
    """Name a part that has changed since the trial was planned, e.g. "planner 'mine:Mine'"; None if none has.

    Raises InputError if a part is missing.
    """
    planner, around = trial.planner, trial.around
    if planner.source and part_source(load_planner(planner.spec.name)) != planner.source:
        return f"planner '{planner.spec.name}'"
    now = sources(around.conditions)
    changed = sorted(k for k in now | dict(around.sources) if now.get(k) != around.sources.get(k))
    return f"{changed[0]} '{getattr(around.conditions, changed[0])}'" if changed else None


def play(order: Order) -> None:
    """Play a trial into its work directory.

    Raises what `run_trial` raises, and InputError if it would not be the planned trial.
    """
    problem, what = order.trial.problem, changed_part(order.trial)
    if what is None and problem_fingerprint(load_problem(order.problem)) != problem.digest:
        what = f"problem '{problem.name}', or an object of your own that is in it,"
    if what is not None:
        raise InputError(
            f"The {what} has changed since this benchmark was begun. Begin another one (--out), or put the file back."
        )
    run_trial(
        order.trial.spec(order.problem),
        order.work / TRIAL,
        recording=Recording(pictures=order.pictures),
        overwrite=True,
        vlm_cache=order.vlm_cache,
    )


_PACE_S = 3600.0
"""The remaining time follows from the pace of the last hour."""


@contextmanager
def shown(total: int) -> Iterator[Listener]:
    """Provide a listener that shows progress on standard error while the context lasts."""
    console, played, retrieved = Console(file=sys.stderr), Counter[str](), Counter[str]()
    so_far = TextColumn("retrieved: {task.description}", markup=False)
    columns = (MofNCompleteColumn(), BarColumn(24), TimeRemainingColumn(), so_far)
    live = console.is_terminal
    with Progress(*columns, console=console, disable=not live, speed_estimate_period=_PACE_S) as progress:
        bar = progress.add_task("", total=total)

        def listen(trial: PlannedTrial, result: TrialResult) -> None:
            progress.advance(bar)
            completed, label = result.completed, trial.planner.label
            if completed:
                verdict = "retrieved" if result.retrieved else f"not retrieved ({result.end})"
                verdict += f", {result.picks} picks, {result.drops} dropped"
                played[label] += 1
                retrieved[label] += bool(result.retrieved)
            else:
                verdict = f"ERRORED: {result.error or result.status}"
            if not (live and completed):
                where = f"[{progress.tasks[bar].completed:.0f}/{total}] {label} on {trial.problem.name}"
                console.out(f"{where}, seed {trial.seed}: {verdict}", highlight=False)
            told = ", ".join(f"{label} {retrieved[label]}/{n}" for label, n in played.items())
            progress.update(bar, description=told)

        yield listen

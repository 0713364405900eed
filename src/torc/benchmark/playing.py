"""One trial of a benchmark, in a worker process."""

from dataclasses import dataclass
from pathlib import Path

from torc.benchmark.identity import problem_fingerprint
from torc.benchmark.spec import PlannedTrial
from torc.episode.planners import load_trial_planner
from torc.episode.trial import run_trial
from torc.errors import InputError
from torc.fingerprints import part_source
from torc.pipeline.building import sources
from torc.problems.problem import load_problem
from torc.vlm.cache import CacheConfig

TRIAL, OUTPUT = "trial", "output.txt"
"""In a work directory: the trial, and what its process printed."""


@dataclass(frozen=True)
class Order:
    """What a worker is told: `problem` is a name or path, `work` the directory to play in."""

    trial: PlannedTrial
    problem: str
    work: Path
    vlm_cache: CacheConfig | None = None


def changed_part(trial: PlannedTrial) -> str | None:
    """What is not as it was when the trial was planned, e.g. "planner 'mine:Mine'"; None if everything is.

    Raises InputError: a part is missing.
    """
    planner, around = trial.planner, trial.around
    if planner.source and part_source(load_trial_planner(planner.spec.name)) != planner.source:
        return f"planner '{planner.spec.name}'"
    now = sources(around.conditions)
    changed = sorted(k for k in now | dict(around.sources) if now.get(k) != around.sources.get(k))
    return f"{changed[0]} '{getattr(around.conditions, changed[0])}'" if changed else None


def play(order: Order) -> None:
    """Play a trial; it is in the work directory then.

    Raises as `run_trial`, and InputError where it would not be the trial that was planned.
    """
    problem, what = order.trial.problem, ""
    if changed := changed_part(order.trial):
        what = f"What is in the file of the {changed}"
    elif problem_fingerprint(load_problem(order.problem)) != problem.digest:
        what = f"The problem '{problem.name}', or an object of your own that is in it,"
    if what:
        raise InputError(
            f"{what} has changed since this benchmark was begun. Begin another one (--out), or put the file back."
        )
    run_trial(order.trial.spec(order.problem), order.work / TRIAL, overwrite=True, vlm_cache=order.vlm_cache)

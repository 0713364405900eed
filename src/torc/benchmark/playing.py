"""One trial of a benchmark, in a worker process."""

from dataclasses import dataclass
from pathlib import Path

from torc.benchmark.spec import PlannedTrial
from torc.episode.trial import TrialSpec, run_trial
from torc.vlm.cache import CacheConfig

TRIAL, OUTPUT = "trial", "output.txt"
"""In a work directory: the trial, and what its process printed."""


@dataclass(frozen=True)
class Order:
    """What a worker is told.

    Attributes:
        trial: what to play.
        problem: name or path of the problem.
        work: directory to play in.
        vlm_cache: where replies of a VLM are kept.
    """

    trial: PlannedTrial
    problem: str
    work: Path
    vlm_cache: CacheConfig | None = None


def trial_spec(trial: PlannedTrial, problem: str) -> TrialSpec:
    """As `run_trial` takes it."""
    s = trial.settings
    return TrialSpec(
        problem,
        trial.planner.name,
        trial.seed,
        s.max_picks,
        s.noise,
        s.robot,
        trial.planner.vlm,
        s.min_score,
        grasps=s.grasps,
    )


def play(order: Order) -> None:
    """Play a trial; it is in the work directory then. Raises as `run_trial`."""
    spec = trial_spec(order.trial, order.problem)
    run_trial(spec, order.work / TRIAL, overwrite=True, vlm_cache=order.vlm_cache)

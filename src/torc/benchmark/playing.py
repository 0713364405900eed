"""One trial of a benchmark, in a worker process."""

from dataclasses import dataclass
from pathlib import Path

from torc.benchmark.identity import problem_fingerprint
from torc.benchmark.spec import PlannedTrial
from torc.episode.conditions import sources
from torc.episode.planners import load_trial_planner
from torc.episode.trial import TrialSpec, run_trial
from torc.errors import InputError
from torc.fingerprints import part_source
from torc.scenes.problem import load_problem
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


def changed_part(trial: PlannedTrial) -> str | None:
    """What is not as it was when the trial was planned, e.g. "planner 'mine:Mine'"; None if everything is.

    Raises:
        InputError: a part is missing.
    """
    planner, settings = trial.planner, trial.settings
    if planner.source and part_source(load_trial_planner(planner.name)) != planner.source:
        return f"planner '{planner.name}'"
    found = sources(settings.robot, settings.grasps)
    if found["grasps_source"] != settings.grasps_source:
        return f"grasp planner '{settings.grasps}'"
    return None if found["robot_source"] == settings.robot_source else f"robot '{settings.robot}'"


def play(order: Order) -> None:
    """Play a trial; it is in the work directory then.

    Raises as `run_trial`, and InputError where it would not be the trial that was planned.
    """
    if changed := changed_part(order.trial):
        raise _not_as_planned(f"What is in the file of the {changed}")
    problem = order.trial.problem
    if problem_fingerprint(load_problem(order.problem)) != problem.digest:
        raise _not_as_planned(f"The problem '{problem.name}', or an object of your own that is in it,")
    spec = trial_spec(order.trial, order.problem)
    run_trial(spec, order.work / TRIAL, overwrite=True, vlm_cache=order.vlm_cache)


def _not_as_planned(what: str) -> InputError:
    return InputError(
        f"{what} has changed since this benchmark was begun. Begin another one (--out), or put the file back."
    )

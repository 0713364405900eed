"""Many problems, by one process or several: the same ones either way, in the same order."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial

from torc.generation.config import GenerationConfig
from torc.generation.generator import GeneratedProblem, NotGenerated, generate_problem
from torc.generation.inspection import Inspector
from torc.generation.rejections import Reason
from torc.pipeline.building import build_system
from torc.processes import open_pool
from torc.robots.names import DEFAULT_ROBOT
from torc.specs.conditions import DEFAULT_WORKSPACE, Conditions

Made = GeneratedProblem | NotGenerated
Progress = Callable[["Job", int, Reason], None]
"""Told which job, the number of a rejected attempt, and why it was rejected."""


@dataclass(frozen=True)
class Job:
    """One problem to make."""

    config: GenerationConfig
    seed: int


def generate_batch(
    jobs: Sequence[Job],
    conditions: Conditions,
    workers: int = 1,
    progress: Progress = lambda job, attempt, reason: None,
) -> Iterator[tuple[Job, Made]]:
    """The problems of some jobs, each as soon as it and those before it are done. With several workers (processes),
    progress is not told. Raises TorcError if a process was ended from outside."""
    if workers <= 1:
        for job in jobs:
            yield job, _generate(job, conditions, progress)
        return
    with open_pool(workers) as pool:
        yield from zip(jobs, pool.map(_generate, jobs, [conditions] * len(jobs)))


@cache
def inspector_for(robot: str = DEFAULT_ROBOT, workspace: str = DEFAULT_WORKSPACE) -> Inspector:
    """An inspector with that robot, one per process. Raises InputError for an unknown one."""
    return Inspector(build_system(Conditions(robot=robot, workspace=workspace)))


def _generate(
    job: Job, conditions: Conditions, progress: Progress = lambda job, attempt, reason: None
) -> Made:
    inspector = inspector_for(conditions.robot, conditions.workspace)
    return generate_problem(job.config, job.seed, inspector, partial(progress, job))

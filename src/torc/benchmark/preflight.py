"""Before the first trial: what can be found wrong at once is said at once, and stops nothing later.

Planners are strangers' code, so they are looked at in a process of their own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from torc.benchmark.dispatch import Backend, FailureKind, Task
from torc.benchmark.identity import problem_fingerprint
from torc.benchmark.spec import Around, BenchPlanner, BenchProblem
from torc.episode.planners import PRIVILEGED, load_trial_planner, make_spec_planner
from torc.errors import InputError
from torc.fingerprints import part_source
from torc.pipeline.building import build_system, sources
from torc.plugins import parameters
from torc.problems.problem import Problem, load_problem
from torc.problems.sets import select_problems, shipped_path
from torc.specs.conditions import Conditions
from torc.specs.settings import Settings
from torc.specs.trial import PlannerSpec
from torc.specs.variants import varied
from torc.stages import ASKING, TASK_PLANNERS
from torc.task_planning.registry import planner_paths
from torc.vlm.cache import CacheConfig
from torc.vlm.simulated.situation import Situation


@dataclass(frozen=True)
class Question:
    """Which planner is looked at, and how it would be made.

    Attributes:
        spec: who; its VLM is given to it if it takes a `client`.
        own_vlm: the VLM was named for this planner alone, so that it must ask one.
    """

    spec: PlannerSpec
    vlm_cache: CacheConfig | None = None
    own_vlm: bool = False


def find_problems(selection: str) -> dict[BenchProblem, Problem]:
    """The problems that a user means, in order. Raises InputError, also where two have the same name."""
    found: dict[BenchProblem, Problem] = {}
    files: dict[str, str] = {}
    for name in select_problems(selection):
        problem = load_problem(name)
        first = files.setdefault(problem.name, name)
        if first != name:
            raise InputError(
                f"{first} and {name} are both called '{problem.name}', so their trials would be mixed up. Change "
                "`name:` in one of the files, or leave it out; generated ones are called otherwise with another --seed."
            )
        facts = problem.name, problem.category, problem_fingerprint(problem), shipped_path(name) is not None
        found[BenchProblem(*facts)] = problem
    return found


def split_vlm(text: str) -> tuple[str, str | None]:
    """A planner's name, and the VLM that a user named behind it, as in "vlm-select:simulated:0.9"."""
    name, colon, vlm = text.partition(":")
    return (name, vlm) if colon and name in planner_paths() else (text, None)


def find_planners(
    questions: Sequence[Question], backend: Backend, log_directory: Path
) -> tuple[BenchPlanner, ...]:
    """The planners that are meant, each made once to see whether that works.

    One that crashes here is kept: its trials will be errored, with the cause.

    Raises InputError: a planner is unknown, or cannot be made (no key, missing options).
    """
    tasks = [Task(f"{i}", question, log_directory / f"{i}.txt") for i, question in enumerate(questions)]
    found: dict[str, BenchPlanner] = {}
    for ending in backend.run(look_at, tasks):
        failure = ending.failure
        if failure is not None and failure.kind is FailureKind.RAISED:
            raise InputError(failure.text)
        crashed = BenchPlanner(questions[int(ending.key)].spec)
        found[ending.key] = ending.outcome if failure is None else crashed
    return tuple(found[task.key] for task in tasks)


def find_around(
    conditions: Conditions, variants: Sequence[Settings], backend: Backend, log_directory: Path
) -> tuple[Around, list[Mapping[str, str]]]:
    """The conditions with the fingerprints of the user's own parts, and these fingerprints under each variant.

    All parts are made once to see whether that works: unlike task planners they play in all trials.

    Raises InputError: a part is unknown, or cannot be used.
    """
    asked = [conditions, *(varied(conditions, variant) for variant in variants)]
    tasks = [Task(f"{i}", each, log_directory / f"conditions-{i}.txt") for i, each in enumerate(asked)]
    found: dict[str, Mapping[str, str]] = {}
    for ending in backend.run(look_around, tasks):
        if failure := ending.failure:
            raised = failure.kind is FailureKind.RAISED
            why = "" if raised else "The parts around the planners cannot be made: "
            raise InputError(why + failure.text)
        found[ending.key] = ending.outcome
    first, *others = (found[task.key] for task in tasks)
    return Around(conditions, first), others


def look_around(conditions: Conditions) -> dict[str, str]:
    """The fingerprints of the user's own parts, in a worker. Raises InputError, MissingDependencyError."""
    build_system(conditions)
    return sources(conditions)


def look_at(question: Question) -> BenchPlanner:
    """What decides a planner's answers, in a worker. Raises InputError, MissingDependencyError."""
    name, vlm = question.spec.name, question.spec.vlm
    maker = load_trial_planner(name)
    vlm = vlm if "client" in parameters(maker) else None
    if vlm is None and name in ASKING:
        raise InputError(f"The planner '{name}' asks a model: name it with --vlm, e.g. --vlm gemini:MODEL.")
    if vlm is None and question.own_vlm:
        raise InputError(f"The planner '{name}' asks no model: write '{name}' alone.")
    spec = replace(question.spec, vlm=vlm)
    truth = _not_asked if vlm is not None and vlm.simulated else None
    make_spec_planner(spec, question.vlm_cache if vlm else None, truth)
    shipped = name in TASK_PLANNERS.built_in or name in PRIVILEGED
    return BenchPlanner(spec, "" if shipped else part_source(maker))


def _not_asked() -> Situation:
    """Stands in for a trial's truth while a simulated VLM is only made."""
    raise InputError("There is no trial yet to tell the truth of.")

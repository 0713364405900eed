"""Before the first trial: what can be found wrong at once is said at once, and stops nothing later.

Planners are strangers' code, so they are looked at in a process of their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from torc.benchmark.dispatch import Backend, FailureKind, Task
from torc.benchmark.identity import problem_fingerprint
from torc.benchmark.spec import BenchPlanner, BenchProblem, Settings
from torc.episode.planners import PRIVILEGED, load_trial_planner, make_trial_planner
from torc.errors import InputError
from torc.fingerprints import part_source
from torc.grasping.names import DEFAULT_GRASPS
from torc.grasping.registry import GRASP_PLANNERS, make_grasp_planner
from torc.plugins import load_part, parameters
from torc.robots.loading import load_robot, own_source
from torc.scenes.problem import Problem, load_problem
from torc.scenes.problem_sets import select_problems, shipped_path
from torc.scenes.workspace import Workspace
from torc.task_planning.registry import ASKING, BUILT_IN, planner_paths
from torc.vlm.cache import CacheConfig
from torc.vlm.config import VlmConfig
from torc.vlm.opening import planner_options
from torc.vlm.simulated.situation import Situation


@dataclass(frozen=True)
class Question:
    """Which planner is looked at, and how it would be made.

    Attributes:
        name: in the registry, or module:Class.
        vlm: given to it if it takes a `client`.
        vlm_cache: where the VLM's replies are kept.
        own_vlm: the VLM was named for this planner alone, so that it must ask one.
    """

    name: str
    vlm: VlmConfig | None = None
    vlm_cache: CacheConfig | None = None
    own_vlm: bool = False


def find_problems(selection: str) -> dict[BenchProblem, Problem]:
    """The problems that a user means, in order. Raises InputError, also where two have the same name."""
    found: dict[BenchProblem, Problem] = {}
    files: dict[str, str] = {}
    for name in select_problems(selection):
        problem = load_problem(name)
        if problem.name in files:
            raise InputError(
                f"{files[problem.name]} and {name} are both called '{problem.name}', so their trials would be mixed "
                "up. Change `name:` in one of the files, or leave it out; generated ones are called otherwise with "
                "another --seed."
            )
        files[problem.name] = name
        shipped = shipped_path(name) is not None
        digest = problem_fingerprint(problem)
        found[BenchProblem(problem.name, problem.category, digest, shipped)] = problem
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

    Args:
        questions: which planners.
        backend: where they are made.
        log_directory: for what they print.

    Raises:
        InputError: a planner is unknown, or cannot be made (no key, missing options).
    """
    tasks = [Task(str(i), question, log_directory / f"{i}.txt") for i, question in enumerate(questions)]
    found: dict[str, BenchPlanner] = {}
    for ending in backend.run(look_at, tasks):
        failure = ending.failure
        if failure is not None and failure.kind is FailureKind.RAISED:
            raise InputError(failure.text)
        found[ending.key] = (
            BenchPlanner(questions[int(ending.key)].name) if failure is not None else ending.outcome
        )
    return tuple(found[task.key] for task in tasks)


@dataclass(frozen=True)
class GraspQuestion:
    """Which grasp planner is looked at, and for which robot it is made."""

    name: str
    robot: str


def find_settings(settings: Settings, backend: Backend, log_directory: Path) -> Settings:
    """The settings with the fingerprints of what does not come with torc.

    The grasp planner is made once to see whether that works: unlike a task planner it plays in all trials.

    Raises:
        InputError: the robot or the grasp planner is unknown, or cannot be used.
    """
    settings = replace(settings, robot_source=own_source(settings.robot))
    if settings.grasps == DEFAULT_GRASPS:
        return settings
    task = Task("grasps", GraspQuestion(settings.grasps, settings.robot), log_directory / "grasps.txt")
    (ending,) = backend.run(look_at_grasps, [task])
    failure = ending.failure
    if failure is not None and failure.kind is FailureKind.RAISED:
        raise InputError(failure.text)
    if failure is not None:
        raise InputError(f"The grasp planner '{settings.grasps}' cannot be made: {failure.text}")
    return replace(settings, grasps_source=ending.outcome)


def look_at_grasps(question: GraspQuestion) -> str:
    """The fingerprint of a grasp planner that can be made, in a worker. Raises InputError, MissingDependencyError."""
    robot, workspace = load_robot(question.robot), Workspace()
    make_grasp_planner(question.name, robot.gripper, workspace.support_z_m)
    return part_source(load_part(GRASP_PLANNERS, question.name))


def look_at(question: Question) -> BenchPlanner:
    """What decides a planner's answers, in a worker. Raises InputError, MissingDependencyError."""
    name = question.name
    maker = load_trial_planner(name)
    vlm = question.vlm if "client" in parameters(maker) else None
    if vlm is None and name in ASKING:
        raise InputError(f"The planner '{name}' asks a model: name it with --vlm, e.g. --vlm gemini:MODEL.")
    if vlm is None and question.own_vlm:
        raise InputError(f"The planner '{name}' asks no model: write '{name}' alone.")
    truth = _not_asked if vlm is not None and vlm.simulated else None
    make_trial_planner(name, **planner_options(name, maker, vlm, question.vlm_cache if vlm else None, truth))
    return BenchPlanner(name, vlm, "" if name in BUILT_IN or name in PRIVILEGED else part_source(maker))


def _not_asked() -> Situation:
    """Stands in for a trial's truth while a simulated VLM is only made."""
    raise InputError("There is no trial yet to tell the truth of.")

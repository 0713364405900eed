"""Problems from a configuration and a seed: always the same ones, bit for bit."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

import torc
from torc.errors import PhysicsError
from torc.generation.clutter import (
    ClutterConfig,
    ObjectRange,
    again_at_rest,
    clutter_config,
    make_clutter,
    worst_mover,
)
from torc.generation.config import (
    GENERATOR_VERSION,
    LARGE_PILE_VERSION,
    MANY,
    GenerationConfig,
    Hiddenness,
    Reason,
    RejectedError,
)
from torc.generation.families import SceneFamily, before, scene_family
from torc.generation.inspection import Difficulty, Inspector, SceneView, robot_facts
from torc.generation.sampling import allowed_models
from torc.objects.library import object_description
from torc.pipeline.building import build_system
from torc.pipeline.state import stage_rng
from torc.problems.problem import Problem
from torc.problems.schema import Scalar
from torc.processes import open_pool
from torc.records import MAX_OBJECTS
from torc.registry.loading import short_part_name
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.robots.names import DEFAULT_ROBOT
from torc.sim.settling import UNSEEN, StillnessConfig, watch_stillness, with_poses_of
from torc.sim.simulated_world import build_world
from torc.specs.conditions import DEFAULT_WORKSPACE, Conditions
from torc.workspace.description import Workspace

STILL = StillnessConfig(distance_m=0.0015, angle_rad=float(np.deg2rad(1.5)), early_s=2.5)
"""Stillness of a generated problem: well within what is allowed after 10 s, since the watch may end early."""
_CHANCES = 3
FIRST_LOOKS = 2
"""How many times grasps are planned from the first look, each time with other random candidates: a target that can be
grasped in any of them makes no problem.
"""
_GRIPPER_ROOM_M = 0.005
"""An object that fits into the gripper is narrower than its opening by this."""
_FOUND = ("attempt", "target", "hiddenness", "visible_fraction", "in_front", "beside", "taller")
"""Entries of a problem's origin that do not come from the request."""
_LONGEST_LIST = 1500
"""Longest list of names in a problem's origin, characters."""


@dataclass(frozen=True)
class GeneratedProblem:
    """A problem, its difficulty, the number of scenes tried, and of the other scenes by reason."""

    problem: Problem
    difficulty: Difficulty
    attempts: int
    rejections: dict[Reason, int] = field(default_factory=dict)


@dataclass(frozen=True)
class NotGenerated:
    """No attempt led to a problem of the wanted kind: the number of scenes tried, and by reason."""

    attempts: int
    rejections: dict[Reason, int]


Made = GeneratedProblem | NotGenerated


def generate_problem(
    config: GenerationConfig,
    seed: int,
    inspector: Inspector,
    progress: Callable[[int, Reason], None] = lambda attempt, reason: None,
) -> Made:
    """Return the problem that belongs to a configuration and a seed (at least 0); equal in every process.

    `progress` is called with the number of each rejected attempt, from 1 on, and the reason. Raises InputError if the
    configuration leaves too few object models to choose from.
    """
    low, high = config.objects
    count = int(stage_rng(seed, 0, "object count").integers(low, high + 1))
    room, rejections = inspector.workspace.room, Counter[Reason]()
    models = allowed_models(config, np.inf if room is None else room.height_m)
    for attempt in range(config.attempts):
        try:
            problem, difficulty = _attempt(config, count, models, seed, attempt, inspector)
        except (RejectedError, PhysicsError) as error:
            reason = error.reason if isinstance(error, RejectedError) else Reason.PHYSICS
            rejections[reason] += 1
            progress(attempt + 1, reason)
            continue
        found: dict[str, Scalar] = {"attempt": attempt, "target": problem.target, **difficulty.facts()}
        origin, workspace = _asked(config, seed, inspector.robot) | found, named(inspector.workspace)
        problem = replace(problem, name=problem_name(config, seed), origin=origin, workspace=workspace)
        return GeneratedProblem(problem, difficulty, attempt + 1, dict(rejections))
    return NotGenerated(config.attempts, dict(rejections))


def problem_name(config: GenerationConfig, seed: int) -> str:
    """Return a problem's name, e.g. "structured-s0007"."""
    family = f"{short_part_name(config.family)}-" if config.family else ""
    return f"{family}{config.category}-s{seed:04d}"


def named(workspace: Workspace) -> str:
    """Return the workspace's name for a problem's file: nothing for the default one."""
    return "" if workspace.name == DEFAULT_WORKSPACE else workspace.name


def is_made_from(
    problem: Problem, config: GenerationConfig, seed: int, robot: RobotDescription, workspace: str = ""
) -> bool:
    """True if a problem belongs to a configuration, a seed and a named workspace, according to its file."""
    asked = _asked(config, seed, robot)
    stated = {name: value for name, value in problem.origin.items() if name not in _FOUND}
    return (stated, problem.name, problem.workspace) == (asked, problem_name(config, seed), workspace)


def _for_gripper(
    clutter: ClutterConfig, gripper: GripperDescription, family: SceneFamily | None = None
) -> ClutterConfig:
    """Return the settings of a family. By default no box lies so that it is too wide for the gripper."""
    lying_m = min(clutter.arrangement.lying_width_m, gripper.max_width_m - _GRIPPER_ROOM_M)
    usual = replace(clutter.arrangement, lying_width_m=lying_m)
    return replace(clutter, arrangement=(family or SceneFamily()).arranged(usual))


def _attempt(
    config: GenerationConfig,
    count: int,
    models: tuple[str, ...],
    seed: int,
    attempt: int,
    inspector: Inspector,
) -> tuple[Problem, Difficulty]:
    """Make one scene, and choose a target in it. Raises RejectedError or PhysicsError."""
    family = scene_family(config.family)
    usual = clutter_config(config.category, count, inspector.workspace.room)
    clutter = _for_gripper(usual, inspector.robot.gripper, family)
    spare = max(2, round(clutter.spare * count)) if config.category == "unstructured" else 0
    # If there are enough models, none occurs twice: the target's description must be unique.
    dumped = min(count + spare, MAX_OBJECTS, len(models))
    names = family.sample(dumped, stage_rng(seed, attempt, "models"), models)
    wanted = ObjectRange(max(config.objects[0], count - count // 4), config.objects[1])
    workspace, rng = inspector.workspace, stage_rng(seed, attempt, "target")
    scene = make_clutter(
        names, config.category, wanted, workspace, stage_rng(seed, attempt, "scene"), clutter
    )
    reason = Reason.MOVED_LATER
    for _ in range(_CHANCES):
        view = inspector.view(scene)
        target, reason, gone = choose_target(view, config, inspector, rng)
        if target:
            model = next(o.model for o in scene.objects if o.name == target)
            problem = replace(scene, target=target, description=object_description(model))
            world = build_world(problem, None, workspace, UNSEEN)
            report = watch_stillness(world, STILL)
            if report.still:
                whole = family.finished(problem, inspector, STILL)
                return whole, replace(inspector.difficulty(view, target), objects=len(whole.objects))
            reason, scene = Reason.MOVED_LATER, with_poses_of(world)
            gone = (worst_mover(world, report, STILL),) if len(scene.objects) > wanted.fewest else ()
        elif not gone or len(scene.objects) - len(gone) < wanted.fewest:
            break
        scene = again_at_rest(scene, gone, wanted, workspace, clutter)
    raise RejectedError(reason)


def _asked(config: GenerationConfig, seed: int, robot: RobotDescription) -> dict[str, Scalar]:
    """Return what determines a problem, as in its file: enough to make it again."""
    unusual: dict[str, Scalar] = {
        **robot_facts(robot),
        "held_out": {None: "", True: "only", False: "none"}[config.held_out],
        "kinds": ",".join(config.kinds)[:_LONGEST_LIST],
        "models": ",".join(config.models)[:_LONGEST_LIST],
        "own": config.own,
        "family": config.family,
    }
    large = config.category == "unstructured" and config.objects[1] > MANY
    return {
        "source": "torc problems generate",
        "generator": LARGE_PILE_VERSION if large else GENERATOR_VERSION,
        "torc": torc.__version__,
        "seed": seed,
        "wanted_objects": "-".join(map(str, config.objects)),
        "wanted_hiddenness": config.hidden,
        **{name: value for name, value in unusual.items() if value},
    }


@dataclass(frozen=True)
class Job:
    """One problem to make."""

    config: GenerationConfig
    seed: int


def generate_batch(
    jobs: Sequence[Job],
    conditions: Conditions,
    workers: int = 1,
    progress: Callable[[Job, int, Reason], None] = lambda job, attempt, reason: None,
) -> Iterator[tuple[Job, Made]]:
    """Yield the problems of some jobs, each as soon as it and those before it are done.

    With several workers (processes) `progress` is not called. Raises TorcError if a process was ended from outside.
    """
    if workers <= 1:
        for job in jobs:
            inspector = inspector_for(conditions.robot, conditions.workspace)
            yield job, generate_problem(job.config, job.seed, inspector, partial(progress, job))
        return
    with open_pool(workers) as pool:
        yield from zip(jobs, pool.map(_generate, jobs, [conditions] * len(jobs)))


@cache
def inspector_for(robot: str = DEFAULT_ROBOT, workspace: str = DEFAULT_WORKSPACE) -> Inspector:
    """Return an inspector with that robot, one per process. Raises InputError for an unknown one."""
    return Inspector(build_system(Conditions(robot=robot, workspace=workspace)))


def _generate(job: Job, conditions: Conditions) -> Made:
    return generate_problem(job.config, job.seed, inspector_for(conditions.robot, conditions.workspace))


def choose_target(
    view: SceneView, config: GenerationConfig, inspector: Inspector, rng: np.random.Generator
) -> tuple[str, Reason, tuple[str, ...]]:
    """Choose an object that is hidden as wanted, not graspable at once, and retrievable by the paper's rule.

    Returns its name, or "" with the reason, and the objects that no target can have around it.
    """
    scene, family = view.problem, scene_family(config.family)
    at_all: dict[str, bool] = {}
    """Which objects can be grasped at all: most of those around a candidate are known from the one before."""

    def can_be_grasped(name: str) -> bool:
        if name not in at_all:
            at_all[name] = inspector.graspable_at_all(scene, name)
        return at_all[name]

    def fault_of(name: str) -> Reason | None:
        if (unfit := family.unfit(view, name, inspector)) is not None:
            return unfit
        if family.stuck is None:
            needed = (name, *inspector.around(scene, name).all)
        else:
            needed = (name,)
            if sum(not can_be_grasped(other) for other in before(view, name, inspector)) < family.stuck:
                return Reason.NOTHING_STUCK
        if not all(map(can_be_grasped, needed)):
            return Reason.CANNOT_BE_GRASPED
        return Reason.TRIVIAL if inspector.graspable_at_first(view, name, FIRST_LOOKS) else None

    faults = [Reason.NONE_SO_HIDDEN]
    for name in _candidates(view, config, inspector, rng):
        fault = fault_of(name)
        if fault is None:
            return name, Reason.NONE_SO_HIDDEN, ()
        faults.append(fault)
    gone = tuple(name for name, graspable in at_all.items() if not graspable and family.stuck is None)
    return "", max(faults, key=list(Reason).index), gone


def _candidates(
    view: SceneView, config: GenerationConfig, inspector: Inspector, rng: np.random.Generator
) -> list[str]:
    """Return the objects that are hidden as wanted, in random order; if any will do, visible ones come last."""
    family = scene_family(config.family)
    models = Counter(o.model for o in view.problem.objects)
    # The target's description must be unique in the scene; one of several copies gets a mark.
    unique = [o.name for o in view.problem.objects if (models[o.model] > 1) == family.copied]
    groups = {name: inspector.hiddenness(view, name) for name in unique}
    shuffled = [unique[i] for i in rng.permutation(len(unique))]
    if family.unseen:
        shuffled = [name for name in shuffled if view.pixels(name) == 0]
    wanted = family.hidden or config.hidden
    if wanted == "any":
        return sorted(shuffled, key=lambda name: groups[name] is Hiddenness.VISIBLE)
    return [name for name in shuffled if groups[name].value == wanted]

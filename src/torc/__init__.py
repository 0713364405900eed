"""TORC: targeted object retrieval in clutter.

A robot arm with a parallel gripper and one RGB-D camera finds and retrieves a target, often hidden, from unknown
objects without 3-D models, one pick after another. The names below are the public interface; each is imported when it
is first used.

>>> import torc
>>> torc.problem_names("validation")[0]
'validation-structured-01'
>>> result = torc.play("validation-structured-02", "dg-select").result  # doctest: +SKIP
>>> answer = torc.decide_frame(torc.load_frame("frame.npz"))  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torc.benchmark.rows import Table as Table
    from torc.brain import Answer as Answer
    from torc.brain import Grasp as Grasp
    from torc.brain import decide_frame as decide_frame
    from torc.brain import load_frame as load_frame
    from torc.errors import InputError as InputError
    from torc.errors import TorcError as TorcError
    from torc.perception.protocol import Wanted as Wanted
    from torc.pipeline.frames import save_frame as save_frame
    from torc.pipeline.planners import make_planner as make_planner
    from torc.problems.problem import Problem as Problem
    from torc.problems.problem import load_problem as load_problem
    from torc.problems.sets import problem_names as problem_names
    from torc.records import Decision as Decision
    from torc.records import DependencyGraph as DependencyGraph
    from torc.records import Evidence as Evidence
    from torc.records import GraspStatus as GraspStatus
    from torc.records import Observation as Observation
    from torc.records import PickOutcome as PickOutcome
    from torc.records import PickResult as PickResult
    from torc.records import PlanningContext as PlanningContext
    from torc.robots.loading import load_robot as load_robot
    from torc.specs.conditions import Conditions as Conditions
    from torc.specs.trial import PlannerSpec as PlannerSpec
    from torc.specs.trial import TrialSpec as TrialSpec
    from torc.task_planning.graph_building import build_dependency_graph as build_dependency_graph
    from torc.trials.recorded import read_trial as read_trial
    from torc.trials.trial import Trial as Trial
    from torc.trials.trial import run_trial as run_trial
    from torc.verbs import Episode as Episode
    from torc.verbs import bench as bench
    from torc.verbs import play as play
    from torc.vlm.config import VlmConfig as VlmConfig
    from torc.workspace.workspace_files import load_workspace as load_workspace

__version__ = "0.1.0"

_HOMES = {
    name: module
    for module, names in {
        "torc.benchmark.rows": "Table",
        "torc.brain": "Answer Grasp decide_frame load_frame",
        "torc.trials.recorded": "read_trial",
        "torc.trials.trial": "Trial run_trial",
        "torc.errors": "InputError TorcError",
        "torc.perception.protocol": "Wanted",
        "torc.pipeline.frames": "save_frame",
        "torc.pipeline.planners": "make_planner",
        "torc.problems.problem": "Problem load_problem",
        "torc.problems.sets": "problem_names",
        "torc.records": (
            "Decision DependencyGraph Evidence GraspStatus Observation PickOutcome PickResult PlanningContext"
        ),
        "torc.robots.loading": "load_robot",
        "torc.specs.conditions": "Conditions",
        "torc.specs.trial": "PlannerSpec TrialSpec",
        "torc.task_planning.graph_building": "build_dependency_graph",
        "torc.verbs": "Episode bench play",
        "torc.vlm.config": "VlmConfig",
        "torc.workspace.workspace_files": "load_workspace",
    }.items()
    for name in names.split()
}
"""The module of each name."""
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'torc' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]

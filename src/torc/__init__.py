"""TORC: targeted object retrieval in clutter.

A robot arm with a parallel gripper and one RGB-D camera finds and retrieves a target, often hidden, from
unknown objects without 3-D models, one pick after another. The names below are what scripts need most; each is
imported when it is first used.

>>> import torc
>>> problem = torc.load_problem("validation-structured-02")
>>> trial = torc.run_trial(torc.TrialSpec.of(problem.name, "dg-select"), Path("runs/mine"))  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torc.brain import Answer as Answer
    from torc.brain import decide_frame as decide_frame
    from torc.brain import load_frame as load_frame
    from torc.episode.recorded import read_trial as read_trial
    from torc.episode.trial import run_trial as run_trial
    from torc.errors import InputError as InputError
    from torc.errors import TorcError as TorcError
    from torc.pipeline.planners import make_planner as make_planner
    from torc.problems.problem import Problem as Problem
    from torc.problems.problem import load_problem as load_problem
    from torc.problems.sets import problem_names as problem_names
    from torc.records import Decision as Decision
    from torc.records import PlanningContext as PlanningContext
    from torc.robots.loading import load_robot as load_robot
    from torc.specs.conditions import Conditions as Conditions
    from torc.specs.trial import TrialSpec as TrialSpec
    from torc.verbs import Episode as Episode
    from torc.verbs import bench as bench
    from torc.verbs import play as play

__version__ = "0.1.0"

_HOMES = {
    "Answer": "torc.brain",
    "Conditions": "torc.specs.conditions",
    "Decision": "torc.records",
    "InputError": "torc.errors",
    "PlanningContext": "torc.records",
    "Problem": "torc.problems.problem",
    "TorcError": "torc.errors",
    "TrialSpec": "torc.specs.trial",
    "decide_frame": "torc.brain",
    "load_frame": "torc.brain",
    "load_problem": "torc.problems.problem",
    "load_robot": "torc.robots.loading",
    "make_planner": "torc.pipeline.planners",
    "problem_names": "torc.problems.sets",
    "read_trial": "torc.episode.recorded",
    "run_trial": "torc.episode.trial",
    "Episode": "torc.verbs",
    "bench": "torc.verbs",
    "play": "torc.verbs",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'torc' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *__all__]

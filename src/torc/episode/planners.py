"""The task planners that a trial can have: those of the registry, and those that need the simulation."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from torc.errors import InputError
from torc.plugins import unknown_part
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import PLANNERS, make_planner, planner_paths

PRIVILEGED: Mapping[str, str] = MappingProxyType({"oracle": "torc.episode.oracle.planner:OraclePlanner"})
"""Name -> "module:Class" of the planners that only a simulated trial can have."""


def make_trial_planner(name: str, **options: Any) -> TaskPlanner:
    """The planner of that name, or the class at "module:Class", built with these options. Raises as `make_planner`."""
    known = {**planner_paths(), **PRIVILEGED}
    if name == "human" and name not in known:
        raise InputError("A person chooses at a page in the browser: `torc human PROBLEM` opens it.")
    if name not in known and ":" not in name:
        raise unknown_part(PLANNERS, name, known)
    return make_planner(PRIVILEGED.get(name, name), **options)

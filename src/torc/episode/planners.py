"""The task planners that a trial can have: those of the registry, and those that need the simulation."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from torc.errors import InputError
from torc.plugins import unknown_part
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import PLANNERS, load_planner_class, make_planner, planner_paths

PRIVILEGED: Mapping[str, str] = MappingProxyType({"oracle": "torc.episode.oracle.planner:OraclePlanner"})
"""Name -> "module:Class" of the planners that only a simulated trial can have."""


def make_trial_planner(name: str, **options: Any) -> TaskPlanner:
    """The planner of that name, or the class at "module:Class", built with these options. Raises as `make_planner`."""
    return make_planner(_known(name), **options)


def load_trial_planner(name: str) -> Any:
    """What makes the planner of that name, imported but not called. Raises as `make_planner`."""
    return load_planner_class(_known(name))


def refuse_simulated(name: str) -> None:
    """Raises InputError for a planner that only a simulated trial can have, and names the command."""
    known = planner_paths()
    command = {"human": "torc human"} | {n: f"torc run --planner {n}" for n in PRIVILEGED}
    if name in command and name not in known:
        raise InputError(f"{name} needs the simulation: {command[name]}")


def _known(name: str) -> str:
    """The name as the registry knows it."""
    known = {**planner_paths(), **PRIVILEGED}
    if name == "human" and name not in known:
        raise InputError("A person chooses at a page in the browser: `torc human PROBLEM` opens it.")
    if name not in known and ":" not in name:
        raise unknown_part(PLANNERS, name, known)
    return PRIVILEGED.get(name, name)

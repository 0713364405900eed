"""The task planners that a trial can have: those of the registry, and those that need the simulation."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from torc.errors import InputError
from torc.plugins import unknown_part
from torc.specs.settings import arguments
from torc.specs.trial import PlannerSpec
from torc.stages import TASK_PLANNERS
from torc.task_planning.protocol import TaskPlanner
from torc.task_planning.registry import load_planner_class, make_planner, planner_paths
from torc.vlm.cache import CacheConfig
from torc.vlm.opening import Truth, planner_options

PRIVILEGED: Mapping[str, str] = MappingProxyType(
    {
        "oracle": "torc.episode.oracle.planner:OraclePlanner",
        "informed": "torc.episode.oracle.informed:InformedPlanner",
    }
)
"""Name -> "module:Class" of the planners that only a simulated trial can have."""


def make_trial_planner(name: str, **options: Any) -> TaskPlanner:
    """The planner of that name, or the class at "module:Class", built with these options. Raises as `make_planner`."""
    return make_planner(_known(name), **options)


def load_trial_planner(name: str) -> Any:
    """What makes the planner of that name, imported but not called. Raises as `make_planner`."""
    return load_planner_class(_known(name))


def make_spec_planner(spec: PlannerSpec, cache: CacheConfig | None, truth: Truth | None) -> TaskPlanner:
    """The planner of a trial; `cache` keeps replies of its VLM, `truth` is what the simulated VLM answers from. Raises
    InputError for one that cannot be made so.
    """
    maker = load_trial_planner(spec.name)
    settings = arguments(maker, spec.settings, "planner")
    options = planner_options(spec.name, maker, spec.vlm, cache, truth)
    return make_trial_planner(spec.name, **settings, **options)


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
        raise unknown_part(TASK_PLANNERS, name, known)
    return PRIVILEGED.get(name, name)

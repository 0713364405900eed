"""The task planners that a trial can have: those of the registry, and those that need the simulation."""

from collections.abc import Mapping
from dataclasses import replace
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
        "oracle": "torc.oracle.oracle_planner:OraclePlanner",
        "informed": "torc.oracle.informed:InformedPlanner",
    }
)
"""Name -> "module:Class" of the planners that only a simulated trial can have."""

_HUMAN = "torc.web.expert:HumanPlanner"


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


def spec_of_object(spec: PlannerSpec, planner: TaskPlanner) -> PlannerSpec:
    """Return what is recorded of a trial that a ready-made planner plays.

    That is the spec if it names the planner's class, else the planner's own name. Raises InputError where the record
    would be wrong: settings or a VLM that the planner never got, and another planner's name.
    """
    cls, name = type(planner), getattr(planner, "name", None)
    path = f"{cls.__module__}:{cls.__qualname__}"
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"Task planner {cls.__qualname__} needs a `name`: a line of text for tables.")
    if spec.settings:
        raise InputError(
            f"The settings {', '.join(spec.settings)} do not reach a planner that is made already: give them to "
            f"{cls.__qualname__} itself, or leave out `planner` and name it in the spec."
        )
    known = {**planner_paths(), **PRIVILEGED, "human": _HUMAN}
    if known.get(spec.name) == path or (
        spec.name not in known and spec.name.endswith(f":{cls.__qualname__}")
    ):
        return spec
    if known.get(name, path) != path:
        raise InputError(
            f"'{name}' is the name of another task planner ({known[name]}): give {cls.__qualname__} one of its own."
        )
    if spec.vlm is not None:
        raise InputError(
            f"The spec says that {spec.asking}, but {cls.__qualname__} plays. "
            "Name it in the spec, or leave out the VLM."
        )
    return replace(spec, name=name)


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

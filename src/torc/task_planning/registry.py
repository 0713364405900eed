"""From a planner's name to a planner.

Built-in names are lazy ("module:Class"), so that asking for one planner never imports another's dependencies.
Other packages add names by an entry point of the group "torc.planners", or are named directly as "module:Class".
"""

import inspect
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from types import MappingProxyType
from typing import Any

from torc.errors import InputError, TorcError, UnknownNameError
from torc.task_planning.protocol import TaskPlanner

ENTRY_POINT_GROUP = "torc.planners"

BUILT_IN: Mapping[str, str] = MappingProxyType(
    {
        "random": "torc.task_planning.random_choice:RandomPlanner",
        "dg-select": "torc.task_planning.dg_select:DgSelectPlanner",
        "vlm-select": "torc.vlm.select:VlmSelectPlanner",
        "vlm-grasps": "torc.vlm.select:VlmGraspsPlanner",
        "vlm-fixes-dg": "torc.vlm.fixes_dg:VlmFixesDgPlanner",
    }
)
"""Name -> "module:Class" of the planners that come with torc. Those of `torc.vlm` take a `client` that asks a model."""


def planner_paths() -> dict[str, str]:
    """All known names with their "module:Class": the built-in ones and those of installed packages."""
    installed = {point.name: point.value for point in entry_points(group=ENTRY_POINT_GROUP)}
    return installed | dict(BUILT_IN)


def planner_names() -> tuple[str, ...]:
    """All known names, sorted."""
    return tuple(sorted(planner_paths()))


def make_planner(name: str, **options: Any) -> TaskPlanner:
    """The planner of that name, or the class at "module:Class", built with these options.

    Raises UnknownNameError for a name nobody registered, and InputError where the class cannot be imported, does
    not take the options, or does not build a planner; the cause is in the text.
    """
    path = _path(name)
    planner = _construct(_load_class(name, path), name, path, options)
    if not callable(getattr(planner, "decide", None)) or not isinstance(getattr(planner, "name", None), str):
        raise InputError(
            f"Task planner '{name}' ({path}) needs a string `name` and a method `decide(context, rng)`; "
            f"{type(planner).__name__} lacks one of them."
        )
    return planner


def load_planner_class(name: str) -> Any:
    """What makes the planner of that name, imported but not called. Raises as `make_planner`."""
    return _load_class(name, _path(name))


def _path(name: str) -> str:
    known = planner_paths()
    if name not in known and ":" not in name:
        raise UnknownNameError("task planner", name, list(known))
    return known.get(name, name)


def _load_class(name: str, path: str) -> Any:
    module_name, _, attribute = path.partition(":")
    if not module_name or not attribute:
        raise InputError(
            f"Task planner '{name}' must be written module:Class, e.g. my_package.my_module:MyPlanner."
        )
    try:
        found: Any = import_module(module_name)
        for part in attribute.split("."):
            found = getattr(found, part)
    except TorcError:
        raise
    except AttributeError as error:
        raise InputError(
            f"Task planner '{name}': module {module_name} has no '{attribute}' ({error})."
        ) from error
    except (
        Exception,
        SystemExit,
    ) as error:  # a third party's module may fail in any way while it is imported
        raise InputError(
            f"Task planner '{name}': importing {module_name} failed with {type(error).__name__}: {error}. "
            "Is it installed in this environment, or on PYTHONPATH?"
        ) from error
    if not callable(found):
        raise InputError(f"Task planner '{name}': {path} is a {type(found).__name__}, not a class.")
    return found


def _construct(factory: Any, name: str, path: str, options: dict[str, Any]) -> Any:
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):  # compiled classes may tell no signature
        signature = None
    try:
        if signature is not None:
            signature.bind(**options)
    except TypeError as error:
        raise InputError(
            f"Task planner '{name}' ({path}) does not take the options {sorted(options)}: {error}. "
            f"It takes {signature}."
        ) from error
    try:
        return factory(**options)
    except TorcError:
        raise
    except (Exception, SystemExit) as error:  # as above
        raise InputError(
            f"Task planner '{name}' ({path}) could not be made: {type(error).__name__}: {error}."
        ) from error

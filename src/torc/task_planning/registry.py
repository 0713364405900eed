"""From a planner's name to a planner.

Other packages add names by an entry point of the group "torc.planners", or are named directly as "module:Class".
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from torc.errors import InputError
from torc.plugins import PartKind, load_part, make_part, part_paths
from torc.task_planning.protocol import TaskPlanner

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
ASKING = tuple(name for name, path in BUILT_IN.items() if path.startswith("torc.vlm."))
"""Names of the planners that come with torc and ask a model."""
PLANNERS = PartKind("task planner", "torc.planners", "decide(context, rng)", BUILT_IN)


def planner_paths() -> dict[str, str]:
    """All known names with their "module:Class": the built-in ones and those of installed packages."""
    return part_paths(PLANNERS)


def planner_names() -> tuple[str, ...]:
    """All known names, sorted."""
    return tuple(sorted(planner_paths()))


def make_planner(name: str, **options: Any) -> TaskPlanner:
    """The planner of that name, or the class at "module:Class", built with these options.

    Raises UnknownNameError for a name nobody registered, and InputError where the class cannot be imported, does
    not take the options, or does not build a planner; the cause is in the text.
    """
    planner: TaskPlanner = make_part(PLANNERS, name, options)
    if not isinstance(getattr(planner, "name", None), str):
        raise InputError(
            f"Task planner '{name}' needs a string `name` besides its method `{PLANNERS.call}`; "
            f"{type(planner).__name__} has none."
        )
    return planner


def load_planner_class(name: str) -> Any:
    """What makes the planner of that name, imported but not called. Raises as `make_planner`."""
    return load_part(PLANNERS, name)

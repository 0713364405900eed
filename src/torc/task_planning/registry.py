"""From a planner's name to a planner.

Other packages add names by an entry point of the group "torc.planners", or are named directly as "module:Class".
"""

from typing import Any

from torc.errors import InputError
from torc.plugins import load_part, make_part, part_paths
from torc.stages import TASK_PLANNERS
from torc.task_planning.protocol import TaskPlanner


def planner_paths() -> dict[str, str]:
    """All known names with their "module:Class": the built-in ones and those of installed packages."""
    return part_paths(TASK_PLANNERS)


def make_planner(name: str, **options: Any) -> TaskPlanner:
    """The planner of that name, or the class at "module:Class", built with these options.

    Raises UnknownNameError for a name nobody registered, and InputError where the class cannot be imported, does
    not take the options, or does not build a planner; the cause is in the text.
    """
    planner: TaskPlanner = make_part(TASK_PLANNERS, name, options)
    if not isinstance(getattr(planner, "name", None), str):
        raise InputError(
            f"Task planner '{name}' needs a string `name` besides its method `{TASK_PLANNERS.call}`; "
            f"{type(planner).__name__} has none."
        )
    return planner


def load_planner_class(name: str) -> Any:
    """What makes the planner of that name, imported but not called. Raises as `make_planner`."""
    return load_part(TASK_PLANNERS, name)

"""`--STAGE.SETTING VALUE`: settings of stages on the command line, whatever settings a stage has."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from torc.errors import InputError
from torc.specs.conditions import PipelineSpec
from torc.specs.settings import under
from torc.specs.variants import plain_value

_FLAG = re.compile(r"--([a-z]+)\.([A-Za-z][\w.-]*)(?:=(.*))?", re.DOTALL)


def split_settings(arguments: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """The other arguments, and the settings by dotted path. Raises InputError for one without a value."""
    rest, settings = [], {}
    waiting = iter(arguments)
    for argument in waiting:
        found = _FLAG.fullmatch(argument)
        if found is None:
            rest.append(argument)
            continue
        stage, path, text = found.groups()
        text = next(waiting, None) if text is None else text
        if text is None:
            raise InputError(f"{argument} needs a value.")
        settings[f"{stage}.{path.replace('-', '_')}"] = plain_value(text)
    return rest, settings


def with_settings(command: Any, settings: Mapping[str, Any]) -> Any:
    """A command with these settings in its conditions. Raises InputError for settings that it does not take."""
    if of_planner := under(settings, "planner"):
        if not hasattr(command, "planner_settings"):
            raise InputError(
                "This command takes no settings of a planner; `torc run` and experiment files do."
            )
        command = replace(command, planner_settings=of_planner)
    if of_stages := {k: v for k, v in settings.items() if not k.startswith("planner.")}:
        taking = [f.name for f in fields(command) if isinstance(getattr(command, f.name), PipelineSpec)]
        if not taking:
            raise InputError(
                f"This command takes no settings of stages: leave out --{next(iter(of_stages))}."
            )
        spec = getattr(command, taking[0])
        command = replace(command, **{taking[0]: replace(spec, settings={**spec.settings, **of_stages})})
    return command

"""The configuration of each shipped stage, as it is without settings."""

from pkgutil import resolve_name
from typing import Any

from torc.plugins import load_part
from torc.specs.settings import config_class
from torc.stages import CONFIGURED, STAGES


def stage_configs() -> dict[str, Any]:
    """By stage; the default part of a stage that can be exchanged."""
    found: dict[str, Any] = {}
    for stage, kind in STAGES.items():
        config = config_class(load_part(kind, next(iter(kind.built_in))))
        if config is not None:
            found[stage] = config()
    for stage, path in CONFIGURED.items():
        value = resolve_name(path)
        found[stage] = value() if callable(value) else value
    return found

"""Settings of stages as plain data ("occlusion.smooth_px": 3), and how they change a stage's configuration."""

import inspect
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, get_type_hints

from torc.errors import InputError, UnknownNameError

Settings = Mapping[str, Any]
"""A value by the dotted path of its setting."""


def under(settings: Settings, stage: str) -> dict[str, Any]:
    """The settings of one stage, by their paths within it."""
    prefix = f"{stage}."
    return {k.removeprefix(prefix): value for k, value in settings.items() if k.startswith(prefix)}


def changed(config: Any, settings: Settings, stage: str) -> Any:
    """A configuration (a frozen dataclass, maybe of such dataclasses) with these settings, by their paths within it.

    Raises UnknownNameError for a setting that it has not, InputError for a value of the wrong type or one that it
    refuses; `stage` stands before the paths in messages.
    """
    for path, value in settings.items():
        config = _changed(config, path.split("."), value, f"{stage}.{path}")
    return config


def arguments(factory: Any, settings: Settings, stage: str, default: Any = None) -> dict[str, Any]:
    """The arguments by which a part gets its settings.

    One with a parameter `config`, a dataclass by its annotation, gets one of those with the settings; any other gets
    each as an argument by its name. `default` takes the place of the dataclass's own defaults, if it is one of those.
    """
    made_with = config_class(factory)
    if made_with is None:
        return dict(settings)
    own = default if isinstance(default, made_with) else None
    if not settings:
        return {} if own is None else {"config": own}
    return {"config": changed(made_with() if own is None else own, settings, stage)}


def _changed(config: Any, path: list[str], value: Any, whole: str) -> Any:
    name, *rest = path
    names = [f.name for f in fields(config)] if is_dataclass(config) else []
    if name not in names:
        prefix = whole.removesuffix(".".join(path))
        raise UnknownNameError("setting", whole, [prefix + n for n in names])
    old = getattr(config, name)
    if rest:
        return replace(config, **{name: _changed(old, rest, value, whole)})
    if is_dataclass(old) and value is not None and not isinstance(value, type(old)):
        inner = ", ".join(f"{whole}.{f.name}" for f in fields(old))
        raise InputError(f"The setting {whole} has settings of its own: {inner}.")
    return replace(config, **{name: _as_declared(type(config), name, value, whole)})


def _as_declared(config_class: type, name: str, value: Any, whole: str) -> Any:
    from pydantic import TypeAdapter, ValidationError  # slow to import

    try:
        return TypeAdapter(get_type_hints(config_class)[name]).validate_python(value)
    except ValidationError as error:
        raise InputError(f"The setting {whole} cannot be {value!r}: {error.errors()[0]['msg']}.") from None


def config_class(factory: Any) -> type | None:
    """The dataclass that a factory takes as `config`; None if it takes none, or does not tell."""
    maker = factory.__init__ if inspect.isclass(factory) else factory
    try:
        hint = get_type_hints(maker).get("config")
    except (NameError, TypeError):
        return None
    options = [hint, *getattr(hint, "__args__", ())]
    return next((o for o in options if inspect.isclass(o) and is_dataclass(o)), None)

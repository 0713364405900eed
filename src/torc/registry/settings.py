"""Settings of parts as plain data ("occlusion.smooth_px": 3), and how they change a part's configuration."""

import inspect
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from typing import Any, Self, get_type_hints

from torc.errors import InputError, UnknownNameError
from torc.registry.context import GIVEN, signature_of
from torc.registry.kinds import Traits, traits_of

Settings = Mapping[str, Any]
"""A value by the dotted path of its setting."""
REQUIRED = "(required)"
"""Stands for the default of a setting without one."""


class ConfigTraits(Traits):
    """The traits of a part's configuration."""

    @classmethod
    def rough(cls) -> Self | None:
        """Return the default settings for depth with a sensor's errors; None if they are the usual ones."""
        return None


def under(settings: Settings, stage: str) -> dict[str, Any]:
    """Return the settings of one stage, by their paths within it."""
    prefix = f"{stage}."
    return {k.removeprefix(prefix): value for k, value in settings.items() if k.startswith(prefix)}


def changed(config: Any, settings: Settings, stage: str) -> Any:
    """Return a configuration (a frozen dataclass, possibly of nested ones) with these settings, by paths within it.

    `stage` stands before the paths in messages. Raises UnknownNameError for a setting that does not exist, and
    InputError for a value of the wrong type, or one that the configuration refuses.
    """
    for path, value in settings.items():
        config = _changed(config, path.split("."), value, f"{stage}.{path}")
    return config


def arguments(factory: Any, settings: Settings, stage: str, rough: bool = False) -> dict[str, Any]:
    """Return the arguments that carry a part's settings, given by their paths within the part.

    A part whose parameter `config` is annotated with a dataclass gets one with the settings; any other gets each
    setting as an argument. With `rough` the configuration for a sensor's depth is changed, if there is one. Raises like
    `changed`.
    """
    made_with = config_class(factory)
    if made_with is None:
        taken = signature_of(factory).parameters
        known = [f"{stage}.{name}" for name in sorted({*taken} - GIVEN)]
        anything = any(p.kind is p.VAR_KEYWORD for p in taken.values())
        for name in () if anything else settings:
            if f"{stage}.{name}" not in known:
                raise UnknownNameError("setting", f"{stage}.{name}", known)
        return dict(settings)
    own = traits_of(made_with, ConfigTraits).rough() if rough else None
    if not settings:
        return {} if own is None else {"config": own}
    return {"config": changed(made_with() if own is None else own, settings, stage)}


def settings_of(factory: Any) -> list[tuple[str, Any]]:
    """Return every setting of a part, or of a configuration, with its default; nested ones by their dotted path."""
    config = factory if is_dataclass(factory) else config_class(factory)
    if config is not None:
        return _of_fields(config, "")
    return [
        (name, REQUIRED if p.default is p.empty else p.default)
        for name, p in signature_of(factory).parameters.items()
        if name not in GIVEN and p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)
    ]


def _of_fields(config: Any, prefix: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for field in fields(config):
        value = REQUIRED
        if not inspect.isclass(config):
            value = getattr(config, field.name)
        elif field.default is not MISSING:
            value = field.default
        elif field.default_factory is not MISSING:
            value = field.default_factory()
        path = prefix + field.name
        found += _of_fields(value, f"{path}.") if is_dataclass(value) else [(path, value)]
    return found


def config_class(factory: Any) -> Any:
    """Return the dataclass that a factory takes as `config`; None if it takes none, or if that is unknown."""
    maker = factory.__init__ if inspect.isclass(factory) else factory
    try:
        hint = get_type_hints(maker).get("config")
    except (NameError, TypeError):
        return None
    options = [hint, *getattr(hint, "__args__", ())]
    return next((o for o in options if inspect.isclass(o) and is_dataclass(o)), None)


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

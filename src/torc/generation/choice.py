"""Which objects a problem may be made of."""

from torc.errors import InputError, UnknownNameError
from torc.generation.config import GenerationConfig
from torc.objects.library import (
    builtin_object_names,
    has_object,
    kind_names,
    object_facts,
    object_names,
)
from torc.objects.store import store_directories, stored_objects


def allowed_models(config: GenerationConfig) -> tuple[str, ...]:
    """Names of the object models that a configuration lets be used.

    Raises:
        UnknownNameError: it names a kind or a model that there is not.
        InputError: own objects are asked for and there are none; a kind is one of own objects and they are not asked
            for; or there are fewer models than the objects of a problem: the target's description would not be unique.
    """
    for name in config.models:
        if not has_object(name):
            raise UnknownNameError("object model", name, list(object_names()))
    if config.own and not stored_objects():
        raise InputError(
            f"There are no objects of your own to use (--own): none in {' or '.join(map(str, store_directories()))}. "
            "Import some with `torc objects "
            "import`, or correct TORC_OBJECTS."
        )
    _check_kinds(config)
    pool = config.models or (object_names() if config.own else builtin_object_names())
    facts = [object_facts(name) for name in dict.fromkeys(pool)]
    if config.models and config.kinds and not any(f.kind in config.kinds for f in facts):
        raise InputError(
            f"No object model is left: none of the models {', '.join(config.models)} is of the kinds "
            f"{', '.join(config.kinds)}. Give --kinds or --models alone, or choose what fits together."
        )
    names = tuple(
        f.name
        for f in facts
        if config.held_out in (None, f.held_out) and (not config.kinds or f.kind in config.kinds)
    )
    if len(names) < config.objects[1]:
        raise InputError(
            f"{config.objects[1]} objects are wanted, but there are only {len(names)} object models to choose from. "
            "Ask for fewer objects, or allow more kinds."
        )
    return names


def _check_kinds(config: GenerationConfig) -> None:
    if set(config.kinds) <= set(kind_names()):
        return  # one's own objects need not be read
    known = {*kind_names(), *(own := _own_kinds())}
    for kind in config.kinds:
        if kind not in known:
            raise UnknownNameError("object kind", kind, sorted(known))
        if kind not in kind_names() and not (config.own or config.models):
            raise InputError(
                f"The objects of the kind '{kind}' are your own ({', '.join(own[kind])}). Add --own to use them."
            )


def _own_kinds() -> dict[str, list[str]]:
    """Kinds of one's own objects, and these."""
    kinds: dict[str, list[str]] = {}
    for name in stored_objects():
        try:
            kinds.setdefault(object_facts(name).kind, []).append(name)
        except InputError:  # a damaged one is told of where it is to be used
            continue
    return kinds

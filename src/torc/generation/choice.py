"""Which objects a problem may be made of."""

from torc.errors import InputError, UnknownNameError
from torc.generation.config import GenerationConfig
from torc.objects.library import builtin_object_names, has_object, object_facts, object_names
from torc.objects.store import store_directories, stored_objects


def allowed_models(config: GenerationConfig) -> tuple[str, ...]:
    """Names of the object models that a configuration lets be used.

    Raises:
        UnknownNameError: it names a kind or a model that there is not (kinds of own objects: among those asked for).
        InputError: own objects are asked for and there are none; or there are fewer models than the objects of a
            problem: the target's description would not be unique.
    """
    for name in config.models:
        if not has_object(name):
            raise UnknownNameError("object model", name, list(object_names()))
    if config.own and not stored_objects():
        raise InputError(
            f"There are no objects of your own to use (--own): none in {' or '.join(map(str, store_directories()))}. "
            "Import some with `torc objects import`, or correct TORC_OBJECTS."
        )
    pool = config.models or (object_names() if config.own else builtin_object_names())
    facts = [object_facts(name) for name in dict.fromkeys(pool)]
    known = {f.kind for f in facts}
    for kind in config.kinds:
        if kind not in known:
            raise UnknownNameError("object kind", kind, sorted(known))
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

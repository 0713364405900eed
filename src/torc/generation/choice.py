"""Which objects a problem may be made of."""

from torc.errors import InputError, UnknownNameError
from torc.generation.config import GenerationConfig
from torc.scenes.library import ObjectFacts, builtin_object_names, has_object, object_facts, object_names


def allowed_models(config: GenerationConfig) -> tuple[str, ...]:
    """Names of the object models that a configuration lets be used.

    Raises:
        UnknownNameError: it names a kind or a model that there is not.
        InputError: there are fewer than the objects of a problem: the target's description would not be unique.
    """
    for name in config.models:
        if not has_object(name):
            raise UnknownNameError("object model", name, list(object_names()))
    pool = config.models or (object_names() if config.own else builtin_object_names())
    facts = [object_facts(name) for name in dict.fromkeys(pool)]
    kinds = {f.kind for f in facts}
    for kind in config.kinds:
        if kind not in kinds:
            raise UnknownNameError("object kind", kind, sorted(kinds))
    names = tuple(f.name for f in facts if _is_allowed(f, config))
    if len(names) < config.objects[1]:
        raise InputError(
            f"{config.objects[1]} objects are wanted, but there are only {len(names)} object models to choose from. "
            "Ask for fewer objects, or allow more kinds."
        )
    return names


def _is_allowed(facts: ObjectFacts, config: GenerationConfig) -> bool:
    held_out = config.held_out is None or facts.held_out == config.held_out
    return held_out and (not config.kinds or facts.kind in config.kinds)

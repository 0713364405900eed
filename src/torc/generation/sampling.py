"""Choose the objects of a generated scene, and their names in it."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from torc.errors import InputError, UnknownNameError
from torc.generation.config import GenerationConfig
from torc.objects.library import (
    builtin_object_names,
    has_object,
    load_object,
    object_facts,
    object_names,
    store_directories,
    stored_objects,
)
from torc.records.camera import MAX_OBJECTS


def sample_models(
    count: int, rng: np.random.Generator, held_out: bool | None = None, models: Sequence[str] | None = None
) -> list[str]:
    """Draw random model names of kinds as different as possible, from the built-in ones by default.

    `held_out`: only held-out kinds, only others, or all (None). Raises InputError if too many are wanted, or there is
    nothing to draw from.
    """
    if not 0 <= count <= MAX_OBJECTS:
        raise InputError(f"A scene holds 0 to {MAX_OBJECTS} objects, not {count}.")
    kinds: dict[str, list[str]] = {}
    for facts in map(object_facts, builtin_object_names() if models is None else dict.fromkeys(models)):
        if held_out is None or facts.held_out == held_out:
            kinds.setdefault(facts.kind, []).append(facts.name)
    if count and not kinds:
        raise InputError("There are no object models to draw from. `torc objects list` shows what there is.")
    pools = list(kinds.values())
    names: list[str] = []
    while len(names) < count:
        round_ = [pools[i] for i in rng.permutation(len(pools))]
        taken = set(names)
        for pool in round_[: count - len(names)]:
            free = [name for name in pool if name not in taken] or pool
            names.append(free[int(rng.integers(len(free)))])
    return names


def placement_names(models: Sequence[str]) -> list[str]:
    """Return a unique name for each model: its own, numbered from the second one on."""
    seen: Counter[str] = Counter()
    names = []
    for model in models:
        seen[model] += 1
        names.append(model if seen[model] == 1 else f"{model}_{seen[model]}")
    return names


def allowed_models(config: GenerationConfig, highest_m: float = np.inf) -> tuple[str, ...]:
    """Return the names of the object models that a configuration allows, of those no higher than highest_m.

    Raises UnknownNameError for an unknown kind or model (kinds of user-defined objects: among those requested), and
    InputError if there are none, or fewer than a problem's objects: the target's description would not be unique.
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
        if config.held_out in (None, f.held_out)
        and (not config.kinds or f.kind in config.kinds)
        and (highest_m == np.inf or load_object(f.name).size_m[2] <= highest_m)
    )
    if len(names) < config.objects[1]:
        raise InputError(
            f"{config.objects[1]} objects are wanted, but there are only {len(names)} object models to choose from. "
            "Ask for fewer objects, or allow more kinds."
        )
    return names

"""Choose the objects of a generated scene, and their names in it.

Some scenes are sorted as in a cupboard, tins with tins, cups with cups: there the kind of a thing hints at its place.
"""

from collections import Counter
from collections.abc import Sequence
from types import MappingProxyType

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
from torc.objects.models import ObjectModel
from torc.records.camera import MAX_OBJECTS

Rectangle = tuple[tuple[float, float], tuple[float, float]]
SORTS = MappingProxyType(
    {
        "tins": ("soup_can", "tuna_can", "soda_can"),
        "jars": ("jam_jar", "spice_jar", "vitamin_bottle", "yogurt_pot"),
        "bottles": ("water_bottle", "ketchup_bottle", "shampoo_bottle", "spray_can"),
        "packets": ("pudding_box", "tea_box", "sugar_box", "milk_carton", "soap_box"),
        "cups": ("mug", "tumbler", "teacup", "takeaway_cup"),
        "fruit": ("apple", "orange", "pear", "lemon"),
    }
)
"""The kinds of objects that stand together."""
_SORT_OF = {kind: sort for sort, kinds in SORTS.items() for kind in kinds}
_EACH = 4
"""About this many objects of a sort."""


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
    fit = (f for f in facts if config.held_out in (None, f.held_out) and f.kind in (config.kinds or known))
    names = tuple(f.name for f in fit if highest_m == np.inf or load_object(f.name).size_m[2] <= highest_m)
    if len(names) < config.objects[1]:
        raise InputError(
            f"{config.objects[1]} objects are wanted, but there are only {len(names)} object models to choose from. "
            "Ask for fewer objects, or allow more kinds."
        )
    return names


def sort_of(model: str) -> str:
    """Return the sort of a model; "" if it has none. Raises UnknownNameError for an unknown model."""
    return _SORT_OF.get(object_facts(model).kind, "")


def sample_sorted(count: int, rng: np.random.Generator, models: Sequence[str]) -> list[str]:
    """Draw random models of a few sorts, about equally many of each; one sort after the other.

    Raises InputError if no model of `models` belongs to a sort.
    """
    of_sort = {sort: [name for name in models if sort_of(name) == sort] for sort in SORTS}
    there = [sort for sort, names in of_sort.items() if names]
    if not there:
        raise InputError(f"No model to draw from belongs into a cupboard: {', '.join(_SORT_OF)} do.")
    wanted = min(max(2, round(count / _EACH)), len(there))
    drawn = [there[i] for i in rng.permutation(len(there))[:wanted]]
    shares = [len(part) for part in np.array_split(np.arange(count), wanted)]
    return [name for sort, n in zip(drawn, shares) for name in sample_models(n, rng, models=of_sort[sort])]


def lanes(models: Sequence[ObjectModel], region: Rectangle, rng: np.random.Generator) -> list[Rectangle]:
    """Return the part of a region that each object may stand in.

    Each sort has a lane from front to back, in random order, as wide as its objects need.
    """
    sorts = [sort_of(m.name) for m in models]
    present = list(dict.fromkeys(sorts))
    areas = {s: sum(m.size_m[0] * m.size_m[1] for m, of in zip(models, sorts) if of == s) for s in present}
    x, (low, high) = region
    found, y = {}, low
    for sort in (present[i] for i in rng.permutation(len(present))):
        width = (high - low) * areas[sort] / sum(areas.values())
        found[sort] = (x, (y, y + width))
        y += width
    return [found[sort] for sort in sorts]

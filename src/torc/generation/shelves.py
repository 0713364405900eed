"""Things sorted as in a cupboard: tins with tins, cups with cups, so that the kind of a thing hints at its place."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from torc.errors import InputError
from torc.generation.sampling import sample_models
from torc.objects.library import object_facts
from torc.objects.models import ObjectModel

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

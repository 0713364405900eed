"""How large the objects of one scene may be together: each may be a stranger's, and there may be many."""

from collections.abc import Callable, Iterable

import numpy as np

from torc.errors import InputError
from torc.scenes.library import load_object
from torc.scenes.models import ObjectModel
from torc.scenes.object_schema import MAX_FACES, MAX_TEXTURE_PIXELS, MAX_VERTICES

_OBJECTS = 8
"""So many of the largest there may be. Imported ones mostly are a tenth of that, and any number of them is allowed."""
SCENE_LIMITS = {
    "texture pixels": _OBJECTS * MAX_TEXTURE_PIXELS,
    "triangles": _OBJECTS * MAX_FACES,
    "vertices": _OBJECTS * MAX_VERTICES,
}


def load_models(
    names: Iterable[str], load_model: Callable[[str], ObjectModel] = load_object
) -> tuple[ObjectModel, ...]:
    """The models of a scene's objects, in their order. Several objects of one model count once.

    Args:
        names: of the models.
        load_model: finds the model of a name; the object library by default.

    Raises:
        InputError: together they are too large, or one cannot be read.
    """
    wanted = list(names)
    models: dict[str, ObjectModel] = {}
    total = dict.fromkeys(SCENE_LIMITS, 0)
    for name in dict.fromkeys(wanted):
        models[name] = model = load_model(name)
        for what, count in _amounts(model).items():
            total[what] += count
            if total[what] > SCENE_LIMITS[what]:
                raise InputError(
                    f"The models of the scene's objects up to '{name}' have {total[what]} {what} in all; at most "
                    f"{SCENE_LIMITS[what]} are allowed. Use fewer different objects, or some with fewer {what}."
                )
    return tuple(models[name] for name in wanted)


def _amounts(model: ObjectModel) -> dict[str, int]:
    textures = [v.texture for v in model.visuals if v.texture is not None]
    return {
        "texture pixels": sum(int(np.prod(t.shape[:2])) for t in textures),
        "triangles": sum(len(v.faces) for v in model.visuals),
        "vertices": sum(len(v.vertices) for v in model.visuals),
    }

"""The objects of a scene are bounded together, and loading stops where they are too many."""

from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError, UnknownNameError
from torc.scenes.arrangements import structured_arrangement
from torc.scenes.drops import drop_arrangement
from torc.scenes.library import builtin_object_names, load_object
from torc.scenes.models import ObjectModel
from torc.scenes.object_schema import MAX_FACES, MAX_TEXTURE_PIXELS, MAX_VERTICES
from torc.scenes.problem import ObjectPlacement, Problem
from torc.scenes.scene_limits import load_models
from torc.scenes.workspace import Workspace
from torc.sim.world import build_world

NAMES = [f"own_{i}" for i in range(12)]


class Store:
    """Objects that are as large as one may be; counts how often one is asked for."""

    def __init__(self, **arrays: np.ndarray) -> None:
        die = load_object("die_red")
        self._model = replace(die, visuals=(replace(die.visuals[0], **arrays),))
        self.asked: list[str] = []

    def __call__(self, name: str) -> ObjectModel:
        self.asked.append(name)
        return replace(self._model, name=name)


def _zeros(*shape: int) -> np.ndarray:
    """Zeros that take no memory."""
    return np.broadcast_to(np.zeros((), np.uint8), shape)


LARGEST = {
    "texture pixels": {"texture": _zeros(4, MAX_TEXTURE_PIXELS // 4, 3)},
    "triangles": {"faces": _zeros(MAX_FACES, 3)},
    "vertices": {"vertices": _zeros(MAX_VERTICES, 3)},
}


@pytest.mark.parametrize("what", LARGEST)
def test_no_more_is_loaded_than_a_scene_may_hold(what: str) -> None:
    store = Store(**LARGEST[what])
    assert [m.name for m in load_models(NAMES[:8], store)] == NAMES[:8]
    store.asked.clear()
    with pytest.raises(
        InputError, match=rf"up to 'own_8' have \d+ {what} in all; at most \d+ are allowed. Use fewer"
    ):
        load_models(NAMES, store)
    assert store.asked == NAMES[:9]


def test_objects_alike_count_once() -> None:
    store = Store(**LARGEST["texture pixels"])
    models = load_models([*NAMES[:8], *NAMES[:8], *["own_0"] * 40], store)
    assert store.asked == NAMES[:8]
    assert [m.name for m in models] == [*NAMES[:8], *NAMES[:8], *["own_0"] * 40]


def test_all_that_comes_with_torc_fits_one_scene() -> None:
    assert len(load_models(builtin_object_names())) == len(builtin_object_names())
    with pytest.raises(UnknownNameError):
        load_models(["nothing"])


def test_a_world_of_too_large_objects_is_refused() -> None:
    objects = tuple(ObjectPlacement(name, name, (0.6, 0.0, 1.1), (1.0, 0.0, 0.0, 0.0)) for name in NAMES)
    problem = Problem("p", "structured", "", NAMES[0], objects)
    with pytest.raises(InputError, match="at most 134217728 are allowed"):
        build_world(problem, None, Workspace(), load_model=Store(**LARGEST["texture pixels"]))


@pytest.mark.parametrize("arrange", [structured_arrangement, drop_arrangement])
def test_too_large_objects_are_not_arranged(arrange, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "torc.scenes.scene_limits.SCENE_LIMITS", {"texture pixels": 1, "triangles": 1, "vertices": 1}
    )
    with pytest.raises(InputError, match="in all; at most 1 are allowed"):
        arrange(["mug_red", "die_red"], np.random.default_rng(0))

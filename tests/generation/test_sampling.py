"""Which objects are drawn, and what they are called; the user's own ones only where they are asked for."""

import os
from dataclasses import replace

import numpy as np
import pytest

from torc.errors import InputError, UnknownNameError
from torc.generation.config import GenerationConfig
from torc.generation.sampling import allowed_models, placement_names, sample_models
from torc.objects.library import builtin_object_names, load_object
from torc.objects.object_files import save_object


def test_samples_prefer_different_kinds_and_respect_held_out() -> None:
    rng = np.random.default_rng(2)
    names = sample_models(20, rng)
    assert len({load_object(n).kind for n in names}) == 20
    assert all(load_object(n).held_out for n in sample_models(6, rng, held_out=True))
    assert not any(load_object(n).held_out for n in sample_models(60, rng, held_out=False))
    assert len(set(sample_models(50, rng))) == 50
    with pytest.raises(InputError, match="0 to 64"):
        sample_models(65, rng)


def test_placement_names_are_unique() -> None:
    assert placement_names(["a", "b", "a", "a"]) == ["a", "b", "a_2", "a_3"]


FEW = GenerationConfig(objects=(2, 3))


@pytest.fixture
def own_cube(tmp_path, monkeypatch):
    """An object of the user's own, of a kind of its own."""
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path))
    cube = replace(load_object("die_white"), name="my_cube", kind="cube", description="my cube")
    save_object(cube, tmp_path / "my_cube")
    return "my_cube"


def test_all_that_come_with_torc_by_default(own_cube):
    assert allowed_models(GenerationConfig()) == builtin_object_names()


def test_own_objects_where_they_are_asked_for(own_cube):
    assert allowed_models(GenerationConfig(own=True)) == (*builtin_object_names(), own_cube)
    named = ("mug_red", own_cube, "apple_red")
    assert allowed_models(replace(FEW, models=named)) == named
    assert own_cube in allowed_models(replace(FEW, own=True, kinds=("cube", "mug")))


def test_kinds_models_and_held_out_narrow_it_down():
    kinds = allowed_models(replace(FEW, kinds=("mug", "apple")))
    assert {load_object(name).kind for name in kinds} == {"mug", "apple"}
    assert all(load_object(name).held_out for name in allowed_models(replace(FEW, held_out=True)))
    assert not any(load_object(name).held_out for name in allowed_models(replace(FEW, held_out=False)))
    both = replace(FEW, objects=(2, 2), kinds=("mug",), models=("mug_red", "mug_white", "apple_red"))
    assert allowed_models(both) == ("mug_red", "mug_white")


@pytest.mark.parametrize(
    ("wrong", "error", "told"),
    [
        ({"kinds": ("mugg",)}, UnknownNameError, "Did you mean 'mug'"),
        ({"models": ("mug_rde",)}, UnknownNameError, "Did you mean 'mug_red'"),
        ({"kinds": ("cub",), "own": True}, UnknownNameError, "Did you mean 'cube'"),
        ({"kinds": ("mug",), "objects": (2, 8)}, InputError, "only 3 object models"),
        ({"kinds": ("mug", "cube")}, UnknownNameError, "Unknown object kind 'cube'"),
        ({"kinds": ("soup_can",), "models": ("mug_white",)}, UnknownNameError, "object kind 'soup_can'"),
    ],
)
def test_what_there_is_not_is_an_error(own_cube, wrong, error, told):
    with pytest.raises(error, match=told):
        allowed_models(replace(FEW, **wrong))


def test_own_objects_that_are_not_there_are_told_with_the_place(tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", f"{tmp_path / 'one'}{os.pathsep}{tmp_path / 'two'}")
    told = f"none in {tmp_path / 'one'} or {tmp_path / 'two'}.*torc objects import"
    with pytest.raises(InputError, match=told):
        allowed_models(GenerationConfig(own=True))

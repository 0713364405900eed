"""Families are parts: found by name, or anybody's class."""

import numpy as np
import pytest

from torc.errors import InputError, UnknownNameError
from torc.generation.config import GenerationConfig
from torc.generation.families import SceneFamily, scene_family
from torc.generation.generator import problem_name
from torc.parts.scene_families.look_alikes import LookAlikes


class Piles(SceneFamily):
    category = "unstructured"


OWN = f"{__name__}:Piles"


def test_a_family_is_a_shipped_name_or_somebodys_class():
    assert type(scene_family("")) is SceneFamily
    assert type(scene_family("look-alikes")) is LookAlikes
    assert isinstance(scene_family(OWN), Piles)
    with pytest.raises(UnknownNameError, match="Did you mean 'cupboard'"):
        GenerationConfig(family="cupbord")
    with pytest.raises(InputError, match="are piles"):
        GenerationConfig("structured", family=OWN)


def test_a_name_for_a_file_holds_no_path():
    config = GenerationConfig("unstructured", family=OWN)
    assert problem_name(config, 7) == f"{__name__}.Piles-unstructured-s0007"
    assert problem_name(GenerationConfig(), 7) == "structured-s0007"


def test_families_change_what_they_say():
    usual, cupboard = scene_family("usual"), scene_family("cupboard")
    models = ["mug_red", "apple_red", "soup_can_red", "tuna_can_blue", "milk_carton_blue"]
    with_sorts = cupboard.sample(4, np.random.default_rng(0), models)
    assert len(with_sorts) == 4
    assert sorted(usual.sample(5, np.random.default_rng(0), models)) == sorted(models)

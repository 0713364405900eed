"""Objects that stand are told from those that fall over."""

from dataclasses import replace

import pytest

from torc.objects.library import load_object
from torc.objects.models import CollisionPiece
from torc.sim.object_check import stands


@pytest.mark.parametrize("name", ["mug_red", "banana_yellow", "soup_can_red"])
def test_built_in_objects_stand(name):
    assert stands(load_object(name))


def test_what_leans_out_too_far_does_not_stand():
    pole = CollisionPiece("box", (0.01, 0.01, 0.1))
    arm = CollisionPiece("box", (0.04, 0.01, 0.01), (0.05, 0.0, 0.09))
    model = replace(load_object("die_red"), pieces=(pole, arm), size_m=(0.1, 0.02, 0.2))
    assert not stands(model)

"""A marked model is the model itself with a sticker that is seen from its front alone."""

import numpy as np
import pytest

from torc.errors import UnknownNameError
from torc.objects.library import has_object, load_object, object_facts, object_names
from torc.problems.problem import ObjectPlacement, Problem
from torc.sim.rendering import CameraRenderer
from torc.sim.settling import UNSEEN
from torc.sim.simulated_world import build_world
from torc.workspace.workspace_files import load_workspace

NAME = "cereal_box_purple"


def test_it_differs_in_its_name_and_words_and_one_surface():
    plain, marked = load_object(NAME), load_object(f"{NAME}.marked")
    assert marked.pieces is plain.pieces
    assert (marked.mass_kg, marked.size_m, marked.friction) == (plain.mass_kg, plain.size_m, plain.friction)
    assert marked.visuals[:-1] == plain.visuals
    assert marked.description == object_facts(f"{NAME}.marked").description != plain.description
    assert object_facts(f"{NAME}.marked").builtin
    assert load_object(f"{NAME}.marked") is marked
    assert f"{NAME}.marked" not in object_names()


def test_only_shipped_models_have_marked_ones():
    assert not has_object("golden_spoon.marked")
    assert not has_object(".marked")
    assert not has_object(f"{NAME}.marked.marked")
    with pytest.raises(UnknownNameError):
        load_object("golden_spoon.marked")


def _picture(model, turned):
    wxyz = (0.0, 0.0, 0.0, 1.0) if turned else (1.0, 0.0, 0.0, 0.0)
    size = load_object(NAME).size_m
    box = ObjectPlacement("box", model, (0.65, 0.0, 1.05 + size[2] / 2), wxyz)
    workspace = load_workspace()
    world = build_world(Problem("p", "structured", "", "box", (box,)), None, workspace)
    with CameraRenderer(world, workspace.camera, "rays") as renderer:
        return renderer.render().rgb.astype(int)


def test_the_sticker_is_seen_from_the_front_and_not_from_behind():
    front = np.abs(_picture(NAME, False) - _picture(f"{NAME}.marked", False)).sum(axis=2) > 60
    behind = np.abs(_picture(NAME, True) - _picture(f"{NAME}.marked", True)).sum(axis=2) > 60
    assert front.sum() > 100
    assert behind.sum() == 0


def test_it_behaves_as_the_model_itself():
    size = load_object(NAME).size_m
    worlds = []
    for model in (NAME, f"{NAME}.marked"):
        box = ObjectPlacement("box", model, (0.65, 0.0, 1.05 + size[2] / 2), (1.0, 0.0, 0.0, 0.0))
        problem = Problem("p", "structured", "", "box", (box,))
        worlds.append(build_world(problem, None, load_workspace(), UNSEEN))
    np.testing.assert_array_equal(worlds[0].model.body_mass, worlds[1].model.body_mass)
    np.testing.assert_array_equal(worlds[0].model.body_inertia, worlds[1].model.body_inertia)

"""The law of the importer: objects are where the annotation puts them, computed by hand from the files, to 1 mm; then
the scene settles on the table, or it is told why it does not."""

import json
from dataclasses import replace

import numpy as np
import pytest
from settled_scenes import OBJECTS, QUICK, settled

from tests.helpers.graspclutter6d_tree import SOLIDS, TreeObject, upright, write_tree
from torc.errors import InputError, UnknownNameError
from torc.generation.graspclutter6d.placing import ImportConfig, convert_object, place_objects, settle_scene
from torc.generation.graspclutter6d.reading import read_scene
from torc.geometry.transforms import make_pose
from torc.sim.settling import SettleConfig, StillnessConfig
from torc.workspace.workspace_files import load_workspace

TILTED = upright(56, -0.10, 0.02, 1.0)
PLACED = (
    upright(17, 0.0, 0.0, 0.3),
    upright(44, 0.10, 0.05),
    TreeObject(56, TILTED.T_table_mesh[:, [2, 0, 1, 3]]),  # on its side
    upright(44, 0.10, -0.05, -0.7),
    upright(10, -0.03, -0.17, 0.2),
)
FALLING = (upright(48, 0.0, 0.80), upright(48, 0.0, -0.80))  # still falling when the others are at rest


def _by_hand(root, image=14):
    """Every object's mesh vertices on the table, from nothing but the numbers in the files: millimetres, as written."""
    directory = root / "scenes" / "000249"
    camera = json.loads((directory / "scene_camera.json").read_text())[str(image)]
    clouds = []
    for entry in json.loads((directory / "scene_gt.json").read_text())[str(image)]:
        mesh_mm = 1000 * SOLIDS[entry["obj_id"]][0]
        in_camera = mesh_mm @ np.reshape(entry["cam_R_m2c"], (3, 3)).T + entry["cam_t_m2c"]
        clouds.append(in_camera @ np.reshape(camera["cam_R_w2c"], (3, 3)).T + camera["cam_t_w2c"])
    return clouds


@pytest.mark.parametrize("models", ["models_obj_m", "models"])
@pytest.mark.parametrize(
    ("placement", "middle", "lowest"), [("paper", (0.75, 0.0), 1.08), ("torc", (0.65, -0.12), 1.055)]
)
def test_objects_are_where_the_files_say(tmp_path, models, placement, middle, lowest):
    root = tmp_path / "gc6d"
    write_tree(root, {249: PLACED}, models=(models,))
    scene = read_scene(root, 249)
    converted = {o.object_id: convert_object(root, o.object_id, "a thing", str) for o in scene.objects}
    placements = place_objects(scene, converted, placement)
    by_hand = [0.001 * cloud for cloud in _by_hand(root)]
    low, high = np.concatenate(by_hand).min(axis=0), np.concatenate(by_hand).max(axis=0)
    shift = np.array([*middle, lowest]) - [*(low + high)[:2] / 2, low[2]]
    names = ["obj_000017_0", "obj_000044_0", "obj_000056_0", "obj_000044_1", "obj_000010_0"]
    assert [(p.name, p.model) for p in placements] == [(n, f"gc6d_{n[4:10]}") for n in names]
    for placed, o, expected in zip(placements, scene.objects, by_hand):
        T = placed.T_world_object @ converted[o.object_id].T_object_mesh
        vertices = SOLIDS[o.object_id][0] @ T[:3, :3].T + T[:3, 3]
        assert np.abs(vertices - (expected + shift)).max() < 0.001


def test_a_standing_scene_settles_where_it_was_annotated(tmp_path):
    scene = settled(tmp_path / "a", OBJECTS)
    assert scene.fell == ()
    for placement in scene.problem.objects:
        before = scene.annotated[placement.name]
        assert np.abs(np.subtract(placement.position, before.position)[:2]).max() < 0.002
        assert -0.001 < before.position[2] - placement.position[2] - 0.005 < 0.002
        assert placement.position[2] > load_workspace().support_z_m
    assert settled(tmp_path / "b", OBJECTS).problem == scene.problem


def test_objects_inside_each_other_are_eased_apart_and_told(tmp_path):
    crowded = (*OBJECTS[:2], upright(48, 0.10, 0.10), OBJECTS[2])  # two cans 16 mm inside each other
    scene = settled(tmp_path / "tree", crowded)
    assert any("inside each other" in note for note in scene.notes)
    assert len(scene.problem.objects) == 4


def test_what_falls_off_is_left_out_and_named(tmp_path):
    scene = settled(tmp_path / "tree", (*OBJECTS, *FALLING), config=replace(QUICK, patience=1))
    assert scene.fell == ("obj_000048_0", "obj_000048_1")
    assert {o.name for o in scene.problem.objects}.isdisjoint(scene.fell)
    assert any("fell off" in note and "obj_000048_1" in note for note in scene.notes)


LIFTED = TreeObject(44, make_pose(p=(0, 0, 0.3)) @ OBJECTS[3].T_table_mesh)


@pytest.mark.parametrize(
    ("scene", "config", "told"),
    [
        (
            (upright(17, 0.0, 0.0),),
            QUICK,
            "one object only, so nothing stands around a target",
        ),
        ((upright(17, 0.0, -0.9), upright(48, 0.0, 0.9)), QUICK, "0 of 2 objects"),
        ((*OBJECTS[:3], LIFTED), replace(QUICK, settle=SettleConfig(limit_s=0.15)), "not at rest after 0 s"),
        (OBJECTS, replace(QUICK, still=StillnessConfig(0.0, seconds=0.3), patience=1), "never still"),
    ],
)
def test_a_scene_of_which_no_problem_can_be_made_says_why(tmp_path, scene, config, told):
    with pytest.raises(InputError, match=told):
        settled(tmp_path / "tree", scene, config=config)


def test_all_meshes_are_looked_for_before_any_is_converted(tmp_path):
    root, said = tmp_path / "tree", list[str]()
    write_tree(root, {249: (upright(63, 0.0, 0.0), upright(10, 0.1, 0.1))})
    (root / "models_obj_m" / "obj_000010.obj").unlink()
    with pytest.raises(InputError, match="no mesh of obj_000010"):
        settle_scene(root, read_scene(root, 249), QUICK, said.append)
    assert said == []


def test_an_unknown_placement_is_refused():
    with pytest.raises(UnknownNameError, match="Unknown placement 'foo'"):
        ImportConfig("foo")

"""The law of the importer: objects are where the annotation puts them, computed by hand from the files, to 1 mm."""

import json

import numpy as np
import pytest

from tests.helpers.graspclutter6d_tree import SOLIDS, TreeObject, upright, write_tree
from tests.helpers.plain_mesh_reader import read_plain_mesh
from torc.errors import InputError
from torc.generation.graspclutter6d import objects
from torc.generation.graspclutter6d.alignment import align_to_table
from torc.generation.graspclutter6d.annotations import read_scene
from torc.generation.graspclutter6d.objects import convert_object
from torc.generation.graspclutter6d.placement import PLACEMENTS, place_objects, placement_rule
from torc.objects.library import load_object

TILTED = upright(56, -0.10, 0.02, 1.0)
OBJECTS = (
    upright(17, 0.0, 0.0, 0.3),
    upright(44, 0.10, 0.05),
    TreeObject(56, TILTED.T_table_mesh[:, [2, 0, 1, 3]]),  # on its side
    upright(44, 0.10, -0.05, -0.7),
    upright(10, -0.03, -0.17, 0.2),
)


@pytest.fixture(params=["models_obj_m", "models"])
def root(request, tmp_path, monkeypatch):
    monkeypatch.setenv("TORC_OBJECTS", str(tmp_path / "store"))
    monkeypatch.setattr(objects, "read_mesh", read_plain_mesh)
    write_tree(tmp_path / "gc6d", {249: OBJECTS}, models=(request.param,))
    return tmp_path / "gc6d"


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


def _placed(root, rule):
    scene = align_to_table(read_scene(root, 249))
    converted = {o.object_id: convert_object(root, o.object_id, "a thing", str) for o in scene.objects}
    return place_objects(scene, converted, PLACEMENTS[rule]), converted


def _vertices(placement, converted):
    """The vertices of the object's mesh in the world, by way of the model frame."""
    object_id = int(placement.model.removeprefix("gc6d_"))
    T = placement.T_world_object @ converted[object_id].T_object_mesh
    return SOLIDS[object_id][0] @ T[:3, :3].T + T[:3, 3]


@pytest.mark.parametrize(
    ("rule", "middle", "lowest"), [("paper", (0.75, 0.0), 1.08), ("torc", (0.65, -0.12), 1.055)]
)
def test_objects_are_where_the_files_say(root, rule, middle, lowest):
    placements, converted = _placed(root, rule)
    by_hand = [0.001 * cloud for cloud in _by_hand(root)]
    everything = np.concatenate(by_hand)
    low, high = everything.min(axis=0), everything.max(axis=0)
    shift = np.array([*middle, lowest]) - [*(low + high)[:2] / 2, low[2]]
    for placement, expected in zip(placements, by_hand):
        assert np.abs(_vertices(placement, converted) - (expected + shift)).max() < 0.001


@pytest.mark.parametrize("rule", PLACEMENTS)
def test_the_whole_scene_is_centred_and_stands_above_the_table(root, rule):
    placements, _ = _placed(root, rule)
    points = [
        load_object(p.model).visuals[0].vertices @ p.T_world_object[:3, :3].T + p.T_world_object[:3, 3]
        for p in placements
    ]
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    assert np.allclose((low + high)[:2] / 2, PLACEMENTS[rule].center_xy, atol=1e-6)
    assert low[2] == pytest.approx(PLACEMENTS[rule].lowest_z_m, abs=1e-6)


def test_objects_keep_their_names_and_order(root):
    placements, _ = _placed(root, "torc")
    names = ["obj_000017_0", "obj_000044_0", "obj_000056_0", "obj_000044_1", "obj_000010_0"]
    assert [p.name for p in placements] == names
    assert [p.model for p in placements] == [f"gc6d_{n[4:10]}" for n in names]


def test_unknown_placements_are_refused():
    with pytest.raises(InputError, match="paper, torc"):
        placement_rule("elsewhere")

"""From mesh files to a retrieval: the robot clears one imported object away and fetches another."""

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from torc.geometry.transforms import look_at
from torc.objects.importing import MeshOptions, read_mesh
from torc.objects.importing.storing import add_object
from torc.objects.library import load_object
from torc.problems.problem import ObjectPlacement, Problem, save_problem
from torc.sim.rendering import CameraRenderer
from torc.sim.simulated_world import build_world
from torc.specs.trial import TrialSpec
from torc.trials.trial import run_trial
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

TABLE_Z = load_workspace().support_z_m


def _import_parcel(folder):
    """A textured GLB box, y up: 16 cm wide, 21 cm high, 5 cm deep, red."""
    mesh = trimesh.creation.box((0.16, 0.21, 0.05))
    mesh.unmerge_vertices()
    uv = mesh.vertices[:, :2] / (0.16, 0.21) + 0.5
    pixels = np.zeros((32, 32, 3), np.uint8)
    pixels[..., 0] = 230
    mesh.visual = TextureVisuals(uv=uv, material=PBRMaterial(baseColorTexture=Image.fromarray(pixels)))
    mesh.export(folder / "parcel.glb")
    add_object(read_mesh(folder / "parcel.glb", MeshOptions(mass_kg=0.4)))


def _import_tin(folder):
    """A PLY tin in millimetres, without its underside."""
    tin = trimesh.creation.cylinder(30, 90, sections=32)
    tin.update_faces(tin.face_normals[:, 2] > -0.9)
    tin.export(folder / "tin.ply")
    add_object(read_mesh(folder / "tin.ply", MeshOptions(scale=0.001, mass_kg=0.3)))


def _standing(name, x, y):
    return ObjectPlacement(
        name, name, (x, y, TABLE_Z + load_object(name).size_m[2] / 2 + 0.001), (1.0, 0.0, 0.0, 0.0)
    )


@pytest.mark.slow
def test_imported_objects_are_seen_cleared_away_and_fetched(tmp_path):
    _import_parcel(tmp_path)
    _import_tin(tmp_path)
    placements = (
        _standing("tin", 0.66, -0.12),
        _standing("parcel", 0.58, -0.12),
        _standing("mug_red", 0.66, 0.1),
    )
    problem = Problem("own", "structured", "the tin", "tin", placements)
    save_problem(problem, tmp_path / "own.yaml")

    world = build_world(problem, None, load_workspace())
    mount = CameraMount(look_at((0.1, -0.12, 1.4), (0.6, -0.12, TABLE_Z + 0.1)), 320, 240, 0.8)
    with CameraRenderer(world, mount) as renderer:
        picture = renderer.render_color().astype(int)
    red = (picture[..., 0] > 90) & (picture[..., 1] < 0.3 * picture[..., 0])
    assert red.mean() > 0.02

    spec = TrialSpec.of(str(tmp_path / "own.yaml"), "dg-select", seed=0, max_picks=6)
    result = run_trial(spec, tmp_path / "trial", say=lambda _: None).result
    assert (result.status, result.retrieved, result.drops) == ("completed", True, 0)
    assert 2 <= result.picks <= 4

"""A small tree of files exactly as GraspClutter6D lays them out, with meshes and poses of our own making.

The true poses go in and can be compared with what an importer makes of the files. Nothing here uses the importer.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from torc.geometry.transforms import Pose, invert, look_at, make_pose, rotation_about

Solid = tuple[np.ndarray, np.ndarray]
"""Vertices (n, 3) in metres and triangles (m, 3), counter-clockwise seen from outside."""

_CAMERAS_PER_ANNOTATION = 4


@dataclass(frozen=True)
class TreeObject:
    """An object of a scene: its number, and the pose of its mesh frame on the table (z = 0)."""

    object_id: int
    T_table_mesh: Pose


def box(size: tuple[float, float, float], corner: tuple[float, float, float]) -> Solid:
    """A box with its lower corner somewhere: mesh frames of the data set are rarely central."""
    mesh = trimesh.creation.box(size)
    return mesh.vertices - mesh.bounds[0] + corner, mesh.faces


def can(radius: float, height: float, base: tuple[float, float, float]) -> Solid:
    """A closed cylinder along z, its base centre somewhere."""
    mesh = trimesh.creation.cylinder(radius, height, sections=24)
    return mesh.vertices + np.add(base, (0, 0, height / 2)), mesh.faces


SOLIDS: Mapping[int, Solid] = {
    10: box((0.06, 0.16, 0.21), (-0.01, -0.02, 0.005)),
    17: box((0.05, 0.10, 0.08), (-0.025, -0.05, -0.04)),
    44: can(0.033, 0.058, (0.004, -0.003, -0.02)),
    48: can(0.033, 0.058, (0.0, 0.0, 0.0)),
    56: box((0.04, 0.085, 0.12), (0.02, 0.0, 0.0)),
    63: box((0.028, 0.05, 0.25), (0.0, 0.0, -0.125)),
}
"""Meshes of some of the objects, in metres."""


def upright(object_id: int, x: float, y: float, yaw: float = 0.0) -> TreeObject:
    """An object standing on the table as its mesh does, the middle of its base at (x, y)."""
    vertices, _ = SOLIDS[object_id]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    R = rotation_about((0, 0, 1), yaw)
    return TreeObject(object_id, make_pose(R, np.array([x, y, 0.0]) - R @ [*(low + high)[:2] / 2, low[2]]))


def camera_poses(images: int) -> dict[int, Pose]:
    """T_table_camera of pictures 1 ... images: around the table, high and low, none of them level."""
    poses = {}
    for image in range(1, images + 1):
        angle = 0.9 * ((image - 1) // _CAMERAS_PER_ANNOTATION)
        eye = (0.7 * np.cos(angle), 0.7 * np.sin(angle), 0.5 + 0.05 * (image % _CAMERAS_PER_ANNOTATION))
        roll = make_pose(rotation_about((0, 0, 1), 0.05 * image))
        poses[image] = look_at(eye, (0.02 * image, 0.0, 0.05)) @ roll
    return poses


def write_tree(
    root: Path,
    scenes: Mapping[int, Sequence[TreeObject]],
    models: Sequence[str] = ("models_obj_m",),
    images: int = 20,
) -> None:
    """Writes scenes (the objects of each by its number, in the order of the annotation), meshes and lists.

    Args:
        models: folders of meshes: models_obj_m, models_m, models_obj, models, models_obj_eval, models_eval.
        images: pictures per scene; the data set has 52.
    """
    for scene, objects in scenes.items():
        directory = root / "scenes" / f"{scene:06d}"
        directory.mkdir(parents=True)
        cameras, truth = _annotations(objects, images)
        write_json(directory / "scene_camera.json", cameras)
        write_json(directory / "scene_gt.json", truth)
    for folder in models:
        _write_models(root / folder, sorted({o.object_id for objects in scenes.values() for o in objects}))


def write_json(path: Path, data: Any) -> None:
    """Writes JSON."""
    path.write_text(json.dumps(data), encoding="utf-8")


def edit_json(path: Path, change: Callable[[Any], None]) -> None:
    """Reads JSON, lets `change` edit it, and writes it back."""
    data = json.loads(path.read_text(encoding="utf-8"))
    change(data)
    write_json(path, data)


def _annotations(objects: Sequence[TreeObject], images: int) -> tuple[dict[str, Any], dict[str, Any]]:
    cameras, truth = {}, {}
    for image, T_table_camera in camera_poses(images).items():
        cameras[str(image)] = {
            "cam_K": [1415.0, 0.0, 969.0, 0.0, 1424.0, 548.0, 0.0, 0.0, 1.0],
            "depth_scale": 1.0,
            "cam_R_w2c": T_table_camera[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1000 * T_table_camera[:3, 3]).tolist(),
        }
        truth[str(image)] = []
        for o in objects:
            T = invert(T_table_camera) @ o.T_table_mesh
            pose = {"cam_R_m2c": T[:3, :3].ravel().tolist(), "cam_t_m2c": (1000 * T[:3, 3]).tolist()}
            truth[str(image)].append({**pose, "obj_id": o.object_id})
    return cameras, truth


def _write_models(folder: Path, object_ids: Sequence[int]) -> None:
    folder.mkdir()
    per_metre = 1.0 if folder.name.endswith("_m") else 1000.0
    info = {}
    for object_id in object_ids:
        vertices, faces = SOLIDS[object_id]
        write = _write_obj if "obj" in folder.name else _write_ply
        ending = "obj" if "obj" in folder.name else "ply"
        write(folder / f"obj_{object_id:06d}.{ending}", per_metre * vertices, faces)
        low, size = 1000 * vertices.min(axis=0), 1000 * np.ptp(vertices, axis=0)
        facts = dict(zip(("min_x", "min_y", "min_z", "size_x", "size_y", "size_z"), (*low, *size)))
        info[str(object_id)] = {"diameter": float(np.linalg.norm(size)), **facts}
    write_json(folder / "models_info.json", info)


def _write_obj(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """With a material and a texture, as the data set has them; all of a surface shows one corner of the texture."""
    Image.new("RGB", (8, 8), (200, 60, 40)).save(path.with_suffix(".png"))
    path.with_suffix(".mtl").write_text(f"newmtl material_0\nKd 1 1 1\nmap_Kd {path.stem}.png\n")
    lines = [f"mtllib {path.stem}.mtl", *(f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices)]
    lines += ["vt 0.1 0.1", "vt 0.9 0.1", "vt 0.1 0.9", "usemtl material_0"]
    lines += [f"f {a + 1}/1 {b + 1}/2 {c + 1}/3" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")


def _write_ply(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    trimesh.Trimesh(vertices, faces, vertex_colors=(200, 60, 40), process=False).export(
        path, encoding="ascii"
    )

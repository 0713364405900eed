"""The pose annotations of a scene: scene_camera.json and scene_gt.json, in the layout of the BOP challenge.

Frames: "mesh" is the frame of the object's mesh file, "camera" OpenCV's, "table" the data set's world. Millimetres on
disk, metres here.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from torc.errors import InputError
from torc.generation.graspclutter6d.json_files import read_json
from torc.generation.graspclutter6d.layout import (
    MAX_ID,
    image_id,
    object_stem,
    scene_directory,
)
from torc.geometry.transforms import Pose, make_pose
from torc.records.camera import MAX_OBJECTS

ANNOTATION, CAMERA = 3, "realsense-d435"
"""The picture from which the retrieval paper's authors took their scenes."""
_MAX_IMAGES = 1000
_MIN_DISTANCE_M, _MAX_DISTANCE_M = 0.05, 10.0
_ROUNDING = 1e-3
_NO_ROTATION = 0.02


@dataclass(frozen=True)
class ObjectAnnotation:
    """One object in one picture.

    Attributes:
        object_id: which of the 200 objects.
        instance: counts objects alike, from 0, in file order; this and nothing else tells them apart.
        T_camera_mesh: pose of the mesh frame in the camera frame.
    """

    object_id: int
    instance: int
    T_camera_mesh: Pose

    @property
    def name(self) -> str:
        """As the retrieval paper's authors call it: obj_000044_1."""
        return f"{object_stem(self.object_id)}_{self.instance}"


@dataclass(frozen=True)
class AnnotatedView:
    """One picture of a scene.

    Attributes:
        image: its number.
        camera_pose: what the file calls cam_R_w2c and cam_t_w2c; see `alignment` for what it is.
        objects: in file order, which is the numbering of the mask images too.
    """

    image: int
    camera_pose: Pose
    objects: tuple[ObjectAnnotation, ...]


@dataclass(frozen=True)
class AnnotatedScene:
    """The annotations of a scene.

    Attributes:
        scene: its number.
        directory: where it lies.
        view: the picture asked for.
        others: further pictures with the same objects in the same order.
        notes: what was odd, for people.
    """

    scene: int
    directory: Path
    view: AnnotatedView
    others: tuple[AnnotatedView, ...]
    notes: tuple[str, ...]


def read_scene(root: Path, scene: int, annotation: int = ANNOTATION, camera: str = CAMERA) -> AnnotatedScene:
    """The annotations of one picture of a scene, and of its other pictures as far as they can be read.

    Raises:
        InputError: files or entries missing, or not what they should be; names file, picture, object and remedy.
    """
    image = image_id(annotation, camera)
    directory = scene_directory(root, scene)
    cameras = _images(directory / "scene_camera.json", "the camera poses of a scene")
    truth = _images(directory / "scene_gt.json", "the object poses of a scene")
    notes: list[str] = []
    view = _view(directory, cameras, truth, image)
    others, broken = [], []
    for other in sorted(set(cameras) & set(truth) - {image}):
        try:
            candidate = _view(directory, cameras, truth, other)
        except InputError:
            broken.append(other)
            continue
        if [o.name for o in candidate.objects] == [o.name for o in view.objects]:
            others.append(candidate)
    if broken:
        notes.append(f"the annotation of picture {', '.join(map(str, broken[:5]))} is not readable")
    return AnnotatedScene(scene, directory, view, tuple(others), tuple(notes))


def _images(path: Path, what: str) -> dict[int, Any]:
    data = read_json(path, what)
    if len(data) > _MAX_IMAGES:
        raise InputError(f"{path} lists {len(data)} pictures; at most {_MAX_IMAGES} are allowed.")
    # Negative numbers were spare pictures of the annotation tool; nothing refers to them.
    odd = [key for key in data if not key.removeprefix("-").isdecimal() or len(key) > 7 or not key.isascii()]
    if odd:
        raise InputError(
            f"{path}: {odd[0][:40]!r} is not the number of a picture. Unpack it again from the data set."
        )
    return {int(key): value for key, value in data.items() if not key.startswith("-")}


def _view(directory: Path, cameras: dict[int, Any], truth: dict[int, Any], image: int) -> AnnotatedView:
    camera = _entry(cameras, image, directory / "scene_camera.json")
    objects = _entry(truth, image, directory / "scene_gt.json")
    where = f"{directory / 'scene_camera.json'}, picture {image}"
    if not isinstance(camera, dict):
        raise InputError(f"{where}: must be an object with cam_R_w2c and cam_t_w2c.")
    pose = _pose(camera, "cam_R_w2c", "cam_t_w2c", where)
    where = f"{directory / 'scene_gt.json'}, picture {image}"
    view = AnnotatedView(image, pose, _objects(objects, where))
    distance_m = float(np.median([np.linalg.norm(o.T_camera_mesh[:3, 3]) for o in view.objects]))
    if distance_m < _MIN_DISTANCE_M:
        raise InputError(
            f"{where}: the objects are {1000 * distance_m:.3g} mm from the camera; are these metres?"
        )
    return view


def _entry(images: dict[int, Any], image: int, path: Path) -> Any:
    if image not in images:
        known = ", ".join(map(str, sorted(images)[:8]))
        raise InputError(
            f"{path} has no picture {image}; it has {len(images)}: {known} ... Choose another with --annotation and "
            "--camera: a picture's number is 4 x annotation + 1, 2, 3 or 4 for d415, d435, azure, zivid."
        )
    return images[image]


def _objects(entries: Any, where: str) -> tuple[ObjectAnnotation, ...]:
    if not isinstance(entries, list) or not 0 < len(entries) <= MAX_OBJECTS:
        count = f"{len(entries)} objects" if isinstance(entries, list) else "no list"
        raise InputError(f"{where}: {count}; must list 1 to {MAX_OBJECTS} objects.")
    seen: Counter[int] = Counter()
    objects = []
    for i, entry in enumerate(entries):
        place = f"{where}, object {i}"
        object_id = entry.get("obj_id") if isinstance(entry, dict) else None
        if type(object_id) is not int or not 0 < object_id <= MAX_ID:
            raise InputError(
                f"{place}: obj_id must be a number from 1 to {MAX_ID}, not {str(object_id)[:40]!r}."
            )
        pose = _pose(entry, "cam_R_m2c", "cam_t_m2c", place)
        objects.append(ObjectAnnotation(object_id, seen[object_id], pose))
        seen[object_id] += 1
    return tuple(objects)


def _pose(entry: dict[str, Any], rotation: str, translation: str, where: str) -> Pose:
    """A pose from 9 numbers (row by row, or three rows) and 3 in millimetres."""
    R = _numbers(entry, rotation, 9, where).reshape(3, 3)
    t_m = _numbers(entry, translation, 3, where) / 1000.0
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > _NO_ROTATION or np.linalg.det(R) < 0:
        kind = "a mirroring" if off <= _NO_ROTATION else f"off by {off:.2g}"
        raise InputError(
            f"{where}: {rotation} is no rotation ({kind}). Unpack the scene again, or choose another picture."
        )
    if np.linalg.norm(t_m) > _MAX_DISTANCE_M:
        raise InputError(
            f"{where}: {translation} is {np.linalg.norm(t_m):.3g} m long; millimetres are expected."
        )
    if off > _ROUNDING / 1000:
        u, _, vt = np.linalg.svd(R)
        R = u @ vt
    return make_pose(R, t_m)


def _numbers(entry: dict[str, Any], key: str, count: int, where: str) -> np.ndarray:
    value = entry.get(key)
    if value is None:
        raise InputError(f"{where}: {key} is missing. Unpack the scene again, or choose another picture.")
    if isinstance(value, list) and all(isinstance(row, list) for row in value):
        value = [number for row in value for number in row]
    fine = isinstance(value, list) and len(value) == count
    if not fine or not all(type(v) in (int, float) and abs(v) < 1e9 for v in value):
        raise InputError(f"{where}: {key} must be {count} numbers.")
    return np.array(value, dtype=float)


def same_annotation(a: AnnotatedScene, b: AnnotatedScene) -> bool:
    """Whether two scenes are one and the same: 401 and 404 of the data set are, and others may be."""
    if [o.name for o in a.view.objects] != [o.name for o in b.view.objects]:
        return False
    poses = [[v.camera_pose, *(o.T_camera_mesh for o in v.objects)] for v in (a.view, b.view)]
    return bool(np.array_equal(poses[0], poses[1]))

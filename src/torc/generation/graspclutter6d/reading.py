"""Read scenes of GraspClutter6D from disk, with the objects' poses on their table.

Each scene has scene_camera.json and scene_gt.json in the layout of the BOP challenge: frames "mesh" (of the mesh file)
and "camera" (OpenCV's), millimetres on disk, metres here. Sources: the public API
(https://github.com/SeungBack/graspclutter6dAPI) and the card of the data set
(https://huggingface.co/datasets/GraspClutter6D/GraspClutter6D).

`cam_R_w2c` and `cam_t_w2c` say "world to camera" and hold the opposite: the public API and the retrieval paper's
converter multiply them onto the objects' poses in the camera, and so does this module.
"""

import csv
import re
from collections import Counter
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    Field,
    FiniteFloat,
    TypeAdapter,
    ValidationError,
    field_validator,
)

from torc.errors import InputError, UnknownNameError
from torc.geometry.transforms import Pose, make_pose
from torc.io.reading import read_plain_text
from torc.io.strict_yaml import explain_faults
from torc.problems.schema import Category
from torc.records.camera import MAX_OBJECTS

CAMERAS = ("realsense-d415", "realsense-d435", "azure-kinect", "zivid")
"""In the order of their pictures: each annotation is four pictures, one per camera."""
ANNOTATIONS = 13
ANNOTATION, CAMERA = 3, "realsense-d435"
"""The picture from which the retrieval paper's authors took their scenes."""
MAX_ID = 999_999
_MAX_BYTES = 32_000_000
_MIN_DISTANCE_M, _MAX_DISTANCE_M = 0.05, 10.0
_ROUNDING, _NO_ROTATION = 1e-6, 0.02
"""Deviations of R R^T from the identity: above the first a rotation is made exact, above the second it is refused."""


def _rotation(numbers: list[float]) -> list[float]:
    R = np.reshape(numbers, (3, 3))
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > _NO_ROTATION or np.linalg.det(R) < 0:
        raise ValueError("is no rotation. Unpack the scene again, or choose another picture.")
    if off > _ROUNDING:
        u, _, vt = np.linalg.svd(R)
        R = u @ vt
    return [float(v) for v in R.ravel()]


_Rotation = Annotated[list[FiniteFloat], Field(min_length=9, max_length=9), AfterValidator(_rotation)]
_Translation = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]


class _CameraEntry(BaseModel):
    cam_R_w2c: _Rotation
    cam_t_w2c: _Translation


class _ObjectEntry(BaseModel):
    obj_id: Annotated[int, Field(strict=True, gt=0, le=MAX_ID)]
    cam_R_m2c: _Rotation
    cam_t_m2c: _Translation


class _Picture(BaseModel):
    """One picture; the fields are named like those of the files. Objects are in the order of the mask images."""

    scene_camera: _CameraEntry
    scene_gt: Annotated[list[_ObjectEntry], Field(min_length=1, max_length=MAX_OBJECTS)]

    @field_validator("scene_gt")
    @classmethod
    def _in_millimetres(cls, objects: list[_ObjectEntry]) -> list[_ObjectEntry]:
        distance_mm = float(np.median([np.linalg.norm(o.cam_t_m2c) for o in objects]))
        if not 1000 * _MIN_DISTANCE_M < distance_mm < 1000 * _MAX_DISTANCE_M:
            raise ValueError(f"the objects are {distance_mm:.3g} mm from the camera; are these millimetres?")
        return objects


def _pose(rotation: list[float], translation_mm: list[float]) -> Pose:
    return make_pose(np.reshape(rotation, (3, 3)), np.array(translation_mm) / 1000.0)


@dataclass(frozen=True)
class SceneObject:
    """One object of a scene: which of the 200, and its number among equal ones, from 0, in file order.

    The table's frame has z up, and its origin wherever the data set has it.
    """

    object_id: int
    instance: int
    T_table_mesh: Pose

    @property
    def name(self) -> str:
        """Its name in the retrieval paper: obj_000044_1."""
        return f"{object_stem(self.object_id)}_{self.instance}"


@dataclass(frozen=True)
class AnnotatedScene:
    number: int
    objects: tuple[SceneObject, ...]


def object_stem(object_id: int) -> str:
    """Return the name of an object in the files, without ending: obj_000017."""
    return f"obj_{object_id:06d}"


def image_id(annotation: int, camera: str) -> int:
    """Return the number of a picture in its scene: 4 x annotation + 1, 2, 3 or 4 by camera. Raises InputError."""
    if camera not in CAMERAS:
        raise UnknownNameError("camera", camera, list(CAMERAS))
    if not 0 <= annotation < ANNOTATIONS:
        raise InputError(f"There is no annotation {annotation}; a scene has 0..{ANNOTATIONS - 1}.")
    return 4 * annotation + 1 + CAMERAS.index(camera)


def check_root(root: Path) -> None:
    """Raise InputError for a directory that is not the data set's root."""
    if not (root / "scenes").is_dir():
        raise InputError(
            f"{root} has no folder scenes/: it is not the root of GraspClutter6D. Give the directory that holds "
            "scenes/ and models_obj_m/, unpacked (see docs/problems.md)."
        )


def read_scene(root: Path, scene: int, annotation: int = ANNOTATION, camera: str = CAMERA) -> AnnotatedScene:
    """Read a scene from one of its pictures.

    Raises InputError for missing or malformed files or entries, or if the camera is below the objects, so that the
    frame cannot be a table's.
    """
    image = image_id(annotation, camera)
    directory = root / "scenes" / f"{scene:06d}"
    if not directory.is_dir():
        raise InputError(f"{directory} is missing. Unpack that scene, or choose another.")
    cameras, truth = _pictures(directory / "scene_camera.json"), _pictures(directory / "scene_gt.json")
    if image not in cameras or image not in truth:
        raise InputError(
            f"{directory} has no picture {image} in scene_camera.json and scene_gt.json. Choose another with "
            "--annotation and --camera: a picture's number is 4 x annotation + 1, 2, 3 or 4 for d415, d435, azure, "
            "zivid."
        )
    try:
        picture = _Picture(scene_camera=cameras[image], scene_gt=truth[image])
    except ValidationError as error:
        raise InputError(f"{directory}, picture {image}:\n{explain_faults(error)}") from None
    T_table_camera = _pose(picture.scene_camera.cam_R_w2c, picture.scene_camera.cam_t_w2c)
    seen, objects = Counter[int](), []
    for o in picture.scene_gt:
        T_table_mesh = T_table_camera @ _pose(o.cam_R_m2c, o.cam_t_m2c)
        objects.append(SceneObject(o.obj_id, seen[o.obj_id], T_table_mesh))
        seen[o.obj_id] += 1
    height = T_table_camera[2, 3] - float(np.median([o.T_table_mesh[2, 3] for o in objects]))
    if height <= 0:
        raise InputError(
            f"{directory / 'scene_camera.json'}, picture {image}: the camera is {-height:.2f} m below the objects, so "
            "z does not point up from the table. Choose another picture with --annotation."
        )
    return AnnotatedScene(scene, tuple(objects))


def _pictures(path: Path) -> dict[int, Any]:
    """Return the entries of a file by picture."""
    try:
        return TypeAdapter(dict[int, Any]).validate_json(
            read_plain_text(path, _MAX_BYTES, "a scene's annotation")
        )
    except ValidationError as error:
        raise InputError(
            f"{path} is no annotation of a scene:\n{explain_faults(error)}\nUnpack it again from the data set."
        ) from None


@dataclass(frozen=True)
class PaperProblem:
    """One of the 40 problems of the retrieval paper: the authors' label, the scene's number, and the target, e.g.
    obj_000044_1.
    """

    category: Category
    scene: int
    target: str


@cache
def paper_problems() -> tuple[PaperProblem, ...]:
    """Return the 40 problems, structured first, by scene."""
    rows = csv.DictReader(_lines("paper_problems.csv"))
    return tuple(PaperProblem(cast(Category, r["category"]), int(r["scene"]), r["target"]) for r in rows)


def published_category(scene: int) -> Category:
    """Return the authors' handmade label of a scene. Raises InputError outside the data set's 1000."""
    if not 0 <= scene < 1000:
        raise InputError(f"Scene {scene} has no published label. Give --category.")
    structured = (int(word) for line in _lines("structured_scenes.txt") for word in line.split())
    return "structured" if scene in structured else "unstructured"


def object_words(object_id: int) -> str:
    """Return an object in words: "the can of peaches", or "object 42 of GraspClutter6D"."""
    names = (row["name"] for row in csv.DictReader(_lines("object_names.csv")) if int(row["id"]) == object_id)
    name = next(names, "")
    return f"the {name}" if name else f"object {object_id} of GraspClutter6D"


def parse_object_name(text: str) -> tuple[int, int | None]:
    """Return object id and instance (None if not given) of "obj_000044_1", "44_1" or "44". Raises InputError."""
    found = re.fullmatch(r"(?:obj_)?(\d{1,6})(?:_(\d{1,3}))?", text, re.ASCII)
    if found is None or not 0 < int(found.group(1)) <= MAX_ID:
        raise InputError(
            f"'{text[:60]}' is no object of a scene. Write 44_1 or {object_stem(44)}_1 (object, instance)."
        )
    return int(found.group(1)), None if found.group(2) is None else int(found.group(2))


def _lines(name: str) -> list[str]:
    """Return the lines of a data file without comments."""
    text = (files("torc.generation.graspclutter6d") / "data" / name).read_text(encoding="utf-8")
    return [line for line in text.splitlines() if not line.startswith("#")]

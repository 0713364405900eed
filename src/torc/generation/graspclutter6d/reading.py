"""Scenes as GraspClutter6D has them on disk, with the objects' poses on their table.

Each scene has scene_camera.json and scene_gt.json in the layout of the BOP challenge: frames "mesh" (of the mesh file)
and "camera" (OpenCV's), millimetres on disk, metres here. Sources: the public API
(https://github.com/SeungBack/graspclutter6dAPI) and the card of the data set
(https://huggingface.co/datasets/GraspClutter6D/GraspClutter6D).

`cam_R_w2c` and `cam_t_w2c` say "world to camera" and hold the opposite: the public API and the retrieval paper's
converter multiply them onto the objects' poses in the camera, and the poses that come out of it stand upright on a
horizontal table (scenes/tabletop_structured in https://github.com/DanManN/graspclutter6d_mujoco_sim). Others read them
by their name. So the reading is not believed but measured: an object has one pose in the world, whichever picture it is
computed from, and only one of the two readings makes the pictures of a scene agree.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from jaxtyping import Float
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
from torc.files.reading import read_bytes
from torc.files.strict_yaml import explain_faults
from torc.geometry.transforms import Pose, invert, make_pose
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
"""Deviations of R R^T from the identity: beyond the first a rotation is made exact, beyond the second it is none."""
_MAX_PICTURES = 12
_CLEARLY, _AGREE_M = 0.2, 0.02


def _rotation(numbers: list[float]) -> list[float]:
    R = np.reshape(numbers, (3, 3))
    off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > _NO_ROTATION or np.linalg.det(R) < 0:
        raise ValueError("is no rotation. Unpack the scene again, or choose another picture.")
    if off > _ROUNDING:
        u, _, vt = np.linalg.svd(R)
        R = u @ vt
    return [float(v) for v in R.ravel()]


def _translation(numbers: list[float]) -> list[float]:
    if np.linalg.norm(numbers) > 1000 * _MAX_DISTANCE_M:
        raise ValueError(f"is {np.linalg.norm(numbers) / 1000:.3g} m long; millimetres are expected.")
    return numbers


_Rotation = Annotated[list[FiniteFloat], Field(min_length=9, max_length=9), AfterValidator(_rotation)]
_Translation = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3), AfterValidator(_translation)]


class _CameraEntry(BaseModel):
    cam_R_w2c: _Rotation
    cam_t_w2c: _Translation


class _ObjectEntry(BaseModel):
    obj_id: Annotated[int, Field(strict=True, gt=0, le=MAX_ID)]
    cam_R_m2c: _Rotation
    cam_t_m2c: _Translation


class _Picture(BaseModel):
    """One picture; the fields bear the names of the files. Objects are in the order of the mask images too."""

    scene_camera: _CameraEntry
    scene_gt: Annotated[list[_ObjectEntry], Field(min_length=1, max_length=MAX_OBJECTS)]

    @field_validator("scene_gt")
    @classmethod
    def _in_millimetres(cls, objects: list[_ObjectEntry]) -> list[_ObjectEntry]:
        distance_mm = float(np.median([np.linalg.norm(o.cam_t_m2c) for o in objects]))
        if distance_mm < 1000 * _MIN_DISTANCE_M:
            raise ValueError(f"the objects are {distance_mm:.3g} mm from the camera; are these metres?")
        return objects

    @property
    def object_ids(self) -> list[int]:
        return [o.obj_id for o in self.scene_gt]

    def T_table_camera(self, inverse: bool) -> Pose:
        """The camera's pose, if what is in the file is that, or its inverse."""
        T = _pose(self.scene_camera.cam_R_w2c, self.scene_camera.cam_t_w2c)
        return invert(T) if inverse else T

    def Ts_table_mesh(self, inverse: bool) -> Float[np.ndarray, "n 4 4"]:
        """The objects' poses by one of the two readings."""
        T_table_camera = self.T_table_camera(inverse)
        return np.array([T_table_camera @ _pose(o.cam_R_m2c, o.cam_t_m2c) for o in self.scene_gt])


def _pose(rotation: list[float], translation_mm: list[float]) -> Pose:
    return make_pose(np.reshape(rotation, (3, 3)), np.array(translation_mm) / 1000.0)


@dataclass(frozen=True)
class SceneObject:
    """One object of a scene.

    Attributes:
        object_id: which of the 200 objects.
        instance: counts objects alike, from 0, in file order; this and nothing else tells them apart.
        T_table_mesh: pose of the mesh frame in the frame of the table: z up, the origin wherever the data set has it.
    """

    object_id: int
    instance: int
    T_table_mesh: Pose

    @property
    def name(self) -> str:
        """As the retrieval paper's authors call it: obj_000044_1."""
        return f"{object_stem(self.object_id)}_{self.instance}"


@dataclass(frozen=True)
class AnnotatedScene:
    """A scene by its annotation; `notes` tell what was odd."""

    number: int
    objects: tuple[SceneObject, ...]
    notes: tuple[str, ...] = ()

    def is_same(self, other: "AnnotatedScene") -> bool:
        """Whether two scenes are one and the same: 401 and 404 of the data set are, and others may be."""
        return [o.name for o in self.objects] == [o.name for o in other.objects] and all(
            np.array_equal(a.T_table_mesh, b.T_table_mesh) for a, b in zip(self.objects, other.objects)
        )


def object_stem(object_id: int) -> str:
    """Name of an object in the files, without ending: obj_000017."""
    return f"obj_{object_id:06d}"


def image_id(annotation: int, camera: str) -> int:
    """Number of a picture in its scene: 4 x annotation + 1, 2, 3 or 4 by camera. Raises InputError."""
    if camera not in CAMERAS:
        raise UnknownNameError("camera", camera, list(CAMERAS))
    if not 0 <= annotation < ANNOTATIONS:
        raise InputError(f"There is no annotation {annotation}; a scene has 0..{ANNOTATIONS - 1}.")
    return 4 * annotation + 1 + CAMERAS.index(camera)


def check_root(root: Path) -> None:
    """Raises InputError for a directory that is not the data set's root."""
    if not (root / "scenes").is_dir():
        raise InputError(
            f"{root} has no folder scenes/: it is not the root of GraspClutter6D. Give the directory that holds "
            "scenes/ and models_obj_m/, unpacked (see docs/graspclutter6d.md)."
        )


def read_scene(root: Path, scene: int, annotation: int = ANNOTATION, camera: str = CAMERA) -> AnnotatedScene:
    """A scene by one of its pictures; the others, as far as they can be read, are for comparison.

    Raises:
        InputError: files or entries missing, or not what they should be; or by these poses the camera is below the
            objects, so that the frame is not that of a table.
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
    picture = _picture(directory, image, cameras, truth)
    others, broken = [], []
    for other in sorted(set(cameras) & set(truth) - {image}):
        try:
            others.append(_picture(directory, other, cameras, truth))
        except InputError:
            broken.append(str(other))
    notes = [f"the annotation of picture {', '.join(broken[:5])} is not readable"] if broken else []
    inverse = _is_inverse(picture, [p for p in others if p.object_ids == picture.object_ids], notes)
    Ts_table_mesh = picture.Ts_table_mesh(inverse)
    height = picture.T_table_camera(inverse)[2, 3] - float(np.median(Ts_table_mesh[:, 2, 3]))
    if height <= 0:
        raise InputError(
            f"{directory / 'scene_camera.json'}, picture {image}: the camera is {-height:.2f} m below the objects, so "
            "z does not point up from the table. Choose another picture with --annotation."
        )
    seen, objects = Counter[int](), []
    for object_id, T in zip(picture.object_ids, Ts_table_mesh):
        objects.append(SceneObject(object_id, seen[object_id], T))
        seen[object_id] += 1
    return AnnotatedScene(scene, tuple(objects), tuple(notes))


def _pictures(path: Path) -> dict[int, Any]:
    """What a file says of each picture; negative numbers, spare pictures of the annotation tool, too."""
    try:
        return TypeAdapter(dict[int, Any]).validate_json(read_bytes(path, _MAX_BYTES, "a scene's annotation"))
    except ValidationError as error:
        raise InputError(
            f"{path} is no annotation of a scene:\n{explain_faults(error)}\nUnpack it again from the data set."
        ) from None


def _picture(directory: Path, image: int, cameras: dict[int, Any], truth: dict[int, Any]) -> _Picture:
    try:
        return _Picture(scene_camera=cameras[image], scene_gt=truth[image])
    except ValidationError as error:
        raise InputError(f"{directory}, picture {image}:\n{explain_faults(error)}") from None


def _is_inverse(picture: _Picture, others: list[_Picture], notes: list[str]) -> bool:
    """Whether the camera poses are world-to-camera: the reading that makes the pictures agree. Notes what is odd."""
    if not others:
        notes.append(
            "no second picture shows the same objects, so the camera poses could not be cross-checked"
        )
        return False
    some = others[:: max(1, len(others) // _MAX_PICTURES)]
    direct_m, inverse_m = (_disagreement_m(picture, some, inverse) for inverse in (False, True))
    inverse = inverse_m < _CLEARLY * direct_m and inverse_m < _AGREE_M
    if inverse:
        notes.append(
            "the camera poses are world-to-camera here, as their name says and against the public API"
        )
    elif direct_m > _AGREE_M:
        notes.append(
            f"pictures disagree about where the objects are, by {1000 * direct_m:.0f} mm (median): this scene's "
            "annotation is doubtful"
        )
    return inverse


def _disagreement_m(picture: _Picture, others: list[_Picture], inverse: bool) -> float:
    """Median distance between where this picture and others put the same objects."""
    here = picture.Ts_table_mesh(inverse)[:, :3, 3]
    there = np.array([other.Ts_table_mesh(inverse)[:, :3, 3] for other in others])
    return float(np.median(np.linalg.norm(there - here, axis=2)))

"""Where GraspClutter6D keeps what on disk.

Source: the public API (https://github.com/SeungBack/graspclutter6dAPI) and the card of the data set
(https://huggingface.co/datasets/GraspClutter6D/GraspClutter6D).
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path

from torc.errors import InputError, UnknownNameError

CAMERAS = ("realsense-d415", "realsense-d435", "azure-kinect", "zivid")
"""In the order of their pictures: each annotation is four pictures, one per camera."""
ANNOTATIONS = 13
MAX_ID = 999_999
_FULL_MESHES = (
    ("models_obj_m", "obj", 1.0),
    ("models_m", "ply", 1.0),
    ("models_obj", "obj", 1e-3),
    ("models", "ply", 1e-3),
)
_SIMPLE_MESHES = (("models_obj_eval", "obj", 1e-3), ("models_eval", "ply", 1e-3))


@dataclass(frozen=True)
class MeshFile:
    """A mesh of an object.

    Attributes:
        path: the file.
        unit_m: length of the file's unit in metres, by the folder's name.
    """

    path: Path
    unit_m: float


def image_id(annotation: int, camera: str) -> int:
    """Number of a picture in its scene: 4 x annotation + 1, 2, 3 or 4 by camera.

    Raises:
        InputError: no such annotation (0..12) or camera.
    """
    if camera not in CAMERAS:
        raise UnknownNameError("camera", camera, list(CAMERAS))
    if not 0 <= annotation < ANNOTATIONS:
        raise InputError(f"There is no annotation {annotation}; a scene has 0..{ANNOTATIONS - 1}.")
    return 4 * annotation + 1 + CAMERAS.index(camera)


def object_stem(object_id: int) -> str:
    """Name of an object in the files, without ending: obj_000017."""
    return f"obj_{object_id:06d}"


def check_root(root: Path) -> None:
    """Refuses a directory that is not the data set's root, and says what is missing or where the root may be.

    Raises:
        InputError: no such directory, or without scenes/.
    """
    if not os.path.isdir(root):
        raise InputError(f"There is no directory {root}. Give the one that holds scenes/ and models_obj_m/.")
    if (root / "scenes").is_dir():
        return
    if root.name == "scenes" or any(_is_scene(p.name) for p in root.iterdir()):
        raise InputError(
            f"{root} holds scenes; give its parent, which also holds the models: {root.resolve().parent}."
        )
    if (root / "samples.json").is_file():
        raise InputError(
            f"{root} is a FiftyOne subset of GraspClutter6D, which lacks the annotations of whole scenes. "
            "Download the data set itself: see docs/graspclutter6d.md."
        )
    if (root / "scenes.7z.001").is_file():
        raise InputError(
            f"{root}: scenes.7z.001 is not unpacked yet: 7z x scenes.7z.001 (see docs/graspclutter6d.md)."
        )
    raise InputError(f"{root} has no folder scenes/: it is not the root of GraspClutter6D.")


def scene_ids(root: Path) -> tuple[int, ...]:
    """Numbers of the scenes that are there, ascending. (The public API's own listing looks in the wrong place.)"""
    return tuple(sorted(int(p.name) for p in (root / "scenes").iterdir() if _is_scene(p.name) and p.is_dir()))


def scene_directory(root: Path, scene: int) -> Path:
    """The folder of a scene. Raises InputError if it is not there."""
    if not 0 <= scene <= MAX_ID:
        raise InputError(f"There is no scene {scene}; scenes are numbered 0..999.")
    directory = root / "scenes" / f"{scene:06d}"
    if not directory.is_dir():
        there = scene_ids(root)
        known = (
            f"{len(there)} scenes are there, from {there[0]} to {there[-1]}" if there else "no scene is there"
        )
        raise InputError(f"{directory} is missing ({known}). Unpack that scene, or choose another.")
    return directory


def find_mesh(root: Path, object_id: int) -> MeshFile:
    """The best mesh of an object: the full ones first, textured before coloured, metres before millimetres.

    Raises:
        InputError: there is none.
    """
    name = object_stem(object_id)
    for folder, ending, unit_m in (*_FULL_MESHES, *_SIMPLE_MESHES):
        # obj2mjcf moves each mesh into a folder of its own.
        for path in (root / folder / f"{name}.{ending}", root / folder / name / f"{name}.{ending}"):
            if path.is_file():
                return MeshFile(path, unit_m)
    folders = [f for f, _, _ in (*_FULL_MESHES, *_SIMPLE_MESHES)]
    there = [f for f in folders if (root / f).is_dir()]
    raise InputError(
        f"{root} has no mesh of {name}: looked for {name}.obj or .ply in {', '.join(there) or 'no folder at all'}. "
        f"Unpack one of {', '.join(f'{f}.7z' for f in folders)} there; models_obj_m is the best."
    )


def _is_scene(name: str) -> bool:
    return re.fullmatch(r"\d{6}", name) is not None

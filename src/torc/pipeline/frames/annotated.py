"""Read pictures with true masks from published data sets: OCID, OSD, GraspClutter6D, and torc's frames.

torc needs none of the first three and ships none. OCID and OSD give no camera pose: the support is then assumed level
(`torc.pipeline.frames.level`). Their intrinsics are those of the camera they were taken with, an Asus Xtion, as
evaluations on them use.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int16

from torc.errors import InputError, UnknownNameError
from torc.geometry.transforms import make_pose
from torc.io.pictures import read_pixels
from torc.io.reading import read_json
from torc.pipeline.frames.frame_files import load_frame
from torc.records import BACKGROUND, Observation

_XTION_FOCAL_PX = 570.3422
_MM = 0.001
_MOST_LABELS = 1000


@dataclass(frozen=True)
class AnnotatedPicture:
    """A picture and its true masks.

    Attributes:
        name: its path relative to the data set.
        observation: without labels; its pose is the identity if unknown.
        posed: the camera's pose is known, with z up.
        truth: number of the object per pixel, BACKGROUND for none.
    """

    name: str
    observation: Observation
    posed: bool
    truth: Int16[np.ndarray, "h w"]


_Found = Iterator[tuple[str, Callable[[], AnnotatedPicture]]]


def annotated_pictures(root: Path, layout: str) -> list[tuple[str, Callable[[], AnnotatedPicture]]]:
    """Return the names of a data set's pictures, each with a function that reads it.

    Raises InputError if there are no pictures, UnknownNameError if the layout is not in LAYOUTS.
    """
    if layout not in LAYOUTS:
        raise UnknownNameError("layout of a data set", layout, list(LAYOUTS))
    if not root.is_dir():
        raise InputError(f"There is no directory '{root}'.")
    find, expected = LAYOUTS[layout]
    if not (found := list(find(root))):
        raise InputError(f"'{root}' holds no pictures in the layout of {layout}: {expected}.")
    return found


def _ocid(root: Path) -> _Found:
    for rgb in sorted(root.rglob("rgb/*.png")):
        # 1 is the surroundings, 2 the table if there is one.
        support = (0, 1, 2) if "table" in rgb.parts else (0, 1)
        yield _lazily(root, rgb, ("depth", "label"), support=support)


def _osd(root: Path) -> _Found:
    for rgb in sorted(root.rglob("image_color/*.png")):
        yield _lazily(root, rgb, ("disparity", "annotation"))


def _graspclutter6d(root: Path) -> _Found:
    scenes = root / "scenes" if (root / "scenes").is_dir() else root
    for folder in sorted(p for p in scenes.iterdir() if (p / "scene_camera.json").is_file()):
        cameras = read_json(folder / "scene_camera.json")
        for rgb in sorted((folder / "rgb").glob("*.png")):
            yield _lazily(root, rgb, ("depth", "label"), cameras=cameras)


def _frames(root: Path) -> _Found:
    places = sorted({p.parent for p in root.rglob("frame.json")} | set(root.rglob("*.npz")))
    for place in places:
        yield place.relative_to(root).as_posix(), partial(_of_frame, place, root)


def _of_frame(place: Path, root: Path) -> AnnotatedPicture:
    frame = load_frame(place)
    truth = frame.label_image
    if truth is None:
        raise InputError(f"{place} has no masks to compare with: give labels, or leave it out.")
    return AnnotatedPicture(place.relative_to(root).as_posix(), frame.observation, True, truth)


def _lazily(root: Path, rgb: Path, folders: tuple[str, str], **known: Any) -> tuple[str, Callable[..., Any]]:
    name = rgb.relative_to(root).as_posix()
    files = (rgb, *(rgb.parent.parent / folder / rgb.name for folder in folders))
    return name, partial(_picture, name, files, **known)


def _picture(
    name: str,
    files: tuple[Path, ...],
    support: tuple[int, ...] = (0,),
    cameras: Mapping[str, Any] | None = None,
) -> AnnotatedPicture:
    """Read a picture; `support` are the labels of no object, `cameras` belong to the pictures beside it, if known."""
    rgb, depth, label = (read_pixels(path) for path in files)
    rgb = rgb[..., :3]
    depth, label = (image[..., 0] if image.ndim == 3 else image for image in (depth, label))
    if not rgb.shape[:2] == depth.shape == label.shape:
        raise InputError(
            f"{files[0]}: picture, depth and labels have other sizes: {rgb.shape}, {depth.shape}, {label.shape}."
        )
    numbers = np.unique(label)
    if len(numbers) > _MOST_LABELS:
        raise InputError(f"{files[2]} holds {len(numbers)} different labels; is it a colour picture of them?")
    table = {int(n): BACKGROUND if n in support else i for i, n in enumerate(numbers)}
    truth = np.array([table[int(n)] for n in numbers], np.int16)[np.searchsorted(numbers, label)]
    if cameras is None:
        height, width = depth.shape
        f = _XTION_FOCAL_PX * width / 640
        K, pose = np.array([[f, 0, (width - 1) / 2], [0, f, (height - 1) / 2], [0, 0, 1.0]]), np.eye(4)
        depth_scale_m = _MM
    else:
        K, pose, depth_scale_m = _camera(files[0], cameras)
    depth_m = (depth * depth_scale_m).astype(np.float32)
    observation = Observation(rgb, depth_m, K, pose, np.zeros(0), 0.0)
    return AnnotatedPicture(name, observation, cameras is not None, truth)


def _camera(rgb: Path, cameras: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray, float]:
    """Return intrinsics, pose and metres per unit of depth, by GraspClutter6D's file."""
    try:
        camera = cameras[str(int(rgb.stem))]
        K = np.array(camera["cam_K"], float).reshape(3, 3)
        # The key says world-to-camera, but the pose is camera-to-world, millimetres.
        R, t = np.array(camera["cam_R_w2c"], float).reshape(3, 3), np.array(camera["cam_t_w2c"], float)
        return K, make_pose(R, t * _MM), float(camera["depth_scale"]) * _MM
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(
            f"{rgb.parent.parent / 'scene_camera.json'} has no camera for {rgb.name}: {error}."
        ) from None


LAYOUTS: Mapping[str, tuple[Callable[[Path], _Found], str]] = {
    "ocid": (_ocid, "rgb/*.png with depth/ and label/ beside, anywhere below it"),
    "osd": (_osd, "image_color/*.png with disparity/ (depth in millimetres) and annotation/ beside"),
    "graspclutter6d": (_graspclutter6d, "scenes/000000/ with scene_camera.json, rgb/, depth/ and label/"),
    "frames": (_frames, "frames as docs/frames.md describes them, with labels"),
}
"""By name of a data set, the function that finds its pictures, and what it looks for."""

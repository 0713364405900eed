"""Read pictures with true masks from published data sets: OCID, OSD, GraspClutter6D, and torc's frames.

torc needs none of the first three and ships none. OCID and OSD give no camera pose: the support is then assumed level
(`torc.pipeline.frames.level`). Their intrinsics are those of the camera they were taken with, an Asus Xtion, as
evaluations on them use.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int16
from PIL import Image

from torc.errors import InputError, UnknownNameError
from torc.geometry.transforms import make_pose
from torc.io.reading import read_text
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


def annotated_pictures(root: Path, layout: str) -> list[tuple[str, Callable[[], AnnotatedPicture]]]:
    """Return the names of a data set's pictures, each with a function that reads it.

    Raises InputError if there are no pictures, UnknownNameError if the layout is not in LAYOUTS.
    """
    if layout not in LAYOUTS:
        raise UnknownNameError("layout of a data set", layout, list(LAYOUTS))
    if not root.is_dir():
        raise InputError(f"There is no directory '{root}'.")
    found = list(LAYOUTS[layout](root))
    if not found:
        raise InputError(f"'{root}' holds no pictures in the layout of {layout}: {_EXPECTED[layout]}.")
    return found


_Found = Iterator[tuple[str, Callable[[], AnnotatedPicture]]]


def _ocid(root: Path) -> _Found:
    for rgb in sorted(root.rglob("rgb/*.png")):
        depth, label = (rgb.parent.parent / folder / rgb.name for folder in ("depth", "label"))
        # 1 is the surroundings, 2 the table if there is one.
        support = (0, 1, 2) if "table" in rgb.parts else (0, 1)
        yield _lazily(root, rgb, depth, label, support)


def _osd(root: Path) -> _Found:
    for rgb in sorted(root.rglob("image_color/*.png")):
        depth, label = (rgb.parent.parent / folder / rgb.name for folder in ("disparity", "annotation"))
        yield _lazily(root, rgb, depth, label, (0,))


def _lazily(root: Path, rgb: Path, depth: Path, label: Path, support: tuple[int, ...]) -> Any:
    name = rgb.relative_to(root).as_posix()

    def read() -> AnnotatedPicture:
        return _picture(name, (rgb, depth, label), _xtion, np.eye(4), support)

    return name, read


def _xtion(height: int, width: int) -> np.ndarray:
    f = _XTION_FOCAL_PX * width / 640
    return np.array([[f, 0, (width - 1) / 2], [0, f, (height - 1) / 2], [0, 0, 1.0]])


def _graspclutter6d(root: Path) -> _Found:
    scenes = root / "scenes" if (root / "scenes").is_dir() else root
    for folder in sorted(p for p in scenes.iterdir() if (p / "scene_camera.json").is_file()):
        cameras = _json(folder / "scene_camera.json")
        for rgb in sorted((folder / "rgb").glob("*.png")):
            name = rgb.relative_to(root).as_posix()
            yield name, partial(_of_graspclutter6d, rgb, name, cameras)


def _of_graspclutter6d(rgb: Path, name: str, cameras: Mapping[str, Any]) -> AnnotatedPicture:
    try:
        camera = cameras[str(int(rgb.stem))]
        K = np.array(camera["cam_K"], float).reshape(3, 3)
        # The key says world-to-camera, but the pose is camera-to-world, millimetres.
        R, t = np.array(camera["cam_R_w2c"], float).reshape(3, 3), np.array(camera["cam_t_w2c"], float)
        scale_m = float(camera["depth_scale"]) * _MM
    except (KeyError, ValueError, TypeError) as error:
        raise InputError(
            f"{rgb.parent.parent / 'scene_camera.json'} has no camera for {rgb.name}: {error}."
        ) from None
    depth, label = (rgb.parent.parent / folder / rgb.name for folder in ("depth", "label"))
    return _picture(
        name, (rgb, depth, label), lambda h, w: K, make_pose(R, t * _MM), (0,), scale_m, posed=True
    )


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


def _picture(
    name: str,
    files: tuple[Path, Path, Path],
    intrinsics: Callable[[int, int], np.ndarray],
    pose: np.ndarray,
    support: tuple[int, ...],
    depth_scale_m: float = _MM,
    *,
    posed: bool = False,
) -> AnnotatedPicture:
    rgb, depth, label = (_pixels(path) for path in files)
    rgb, depth, label = rgb[..., :3], _plane(depth), _plane(label)
    if not rgb.shape[:2] == depth.shape == label.shape:
        raise InputError(
            f"{files[0]}: picture, depth and labels have other sizes: {rgb.shape}, {depth.shape}, {label.shape}."
        )
    numbers = np.unique(label)
    if len(numbers) > _MOST_LABELS:
        raise InputError(f"{files[2]} holds {len(numbers)} different labels; is it a colour picture of them?")
    table = {int(n): BACKGROUND if n in support else i for i, n in enumerate(numbers)}
    truth = np.array([table[int(n)] for n in numbers], np.int16)[np.searchsorted(numbers, label)]
    depth_m = (depth * depth_scale_m).astype(np.float32)
    K = intrinsics(*depth.shape)
    return AnnotatedPicture(name, Observation(rgb, depth_m, K, pose, np.zeros(0), 0.0), posed, truth)


def _plane(image: np.ndarray) -> np.ndarray:
    return image[..., 0] if image.ndim == 3 else image


def _pixels(path: Path) -> np.ndarray:
    try:
        with Image.open(path) as image:
            return np.array(image)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error


def _json(path: Path) -> dict[str, Any]:
    try:
        data: dict[str, Any] = json.loads(read_text(path))
    except (OSError, ValueError) as error:
        raise InputError(f"Cannot read {path}: {error}.") from error
    return data


LAYOUTS: Mapping[str, Callable[[Path], _Found]] = {
    "ocid": _ocid,
    "osd": _osd,
    "graspclutter6d": _graspclutter6d,
    "frames": _frames,
}
"""By name of a data set, the function that finds its pictures."""
_EXPECTED = {
    "ocid": "rgb/*.png with depth/ and label/ beside, anywhere below it",
    "osd": "image_color/*.png with disparity/ (depth in millimetres) and annotation/ beside",
    "graspclutter6d": "scenes/000000/ with scene_camera.json, rgb/, depth/ and label/",
    "frames": "frames as docs/frames.md describes them, with labels",
}

"""One RGB-D frame with masks, from anywhere: read, checked, and turned into an Observation.

Two forms are read and written:

- a .npz file with rgb (h, w, 3 uint8), depth_m (float, metres) or depth (integers) with depth_scale (metres per unit,
  0.001 by default), K (3x3), T_world_camera (4x4, OpenCV camera axes, z of the world upwards), labels (h, w integers),
  and optionally target, target_description, support_z_m, background, robot, grid_origin, grid_voxel_size_m and
  grid_shape;
- a directory with rgb.png, depth.png (16 bits), labels.png (8 or 16 bits) and frame.json: intrinsics {fx, fy, cx, cy}
  or K, camera_pose (4x4, or {position, wxyz}), depth_scale_m (0.001), and optionally the same settings, names
  ({label: name}) and grid ({origin, voxel_size_m, shape}).

`target` is a label, a name, or "hidden"; without it label 0 is the target if it is an object's, else the target is
hidden. `background` is -1 if labels hold negative numbers, else 0; `robot` is -2.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int16
from PIL import Image

from torc.errors import InputError
from torc.pipeline.frame_files import RawFrame, as_grid, as_number, read_raw
from torc.pipeline.support_plane import estimate_support_z_m, grid_around, object_points
from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT, TARGET_ID, Observation, VoxelGrid

HIDDEN = "hidden"
_MAX_DEPTH_M = 30.0
_MAX_TEXT = 500
_BACKGROUND_PIXEL, _ROBOT_PIXEL = 255, 254
"""Of labels.png as written here; object ids stay what they are."""
_DEPTH_UNIT_M = 0.0001
"""Of depth.png as written here: 0.1 mm, up to 6.5 m."""


@dataclass(frozen=True)
class Frame:
    """One frame, ready for the pipeline.

    Attributes:
        observation: its label_image holds object ids 0..63, the target being 0.
        target_id: TARGET_ID, or None while the target is hidden.
        target_description: the target in words; may be empty.
        support_z_m: height of the surface that the objects stand on.
        grid: region of the occlusion volume.
        labels: label in the file per object id.
        names: name per object id, where the file has one.
        support_estimated: whether support_z_m was estimated from the image.
    """

    observation: Observation
    target_id: int | None
    target_description: str
    support_z_m: float
    grid: VoxelGrid
    labels: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))
    names: Mapping[int, str] = field(default_factory=lambda: MappingProxyType({}))
    support_estimated: bool = False


def load_frame(path: str | Path) -> Frame:
    """The frame at a .npz file or directory; the module's text says what they hold.

    Labels keep their numbers where those are 1..63; the target becomes 0, and every other object gets the lowest id
    that is free. Raises InputError, naming file, key and remedy, for whatever cannot be used.
    """
    raw = read_raw(Path(path))
    depth_m = _clean_depth(raw)
    _check_camera(raw)
    background, robot = _special_labels(raw)
    present = sorted(set(np.unique(raw.labels).tolist()) - {background, robot})
    _check_labels(raw, present, background)
    target_label = _target_label(raw, present)
    ids = _object_ids(raw, present, target_label)
    observation = Observation(
        rgb=raw.rgb,
        depth_m=depth_m,
        K=raw.K,
        T_world_camera=raw.T_world_camera,
        qpos=np.zeros(0),
        stamp_s=0.0,
        label_image=_relabelled(raw.labels, ids, robot),
    )
    support_z_m, estimated = _support(raw, observation)
    points = object_points(observation)
    grid = raw.settings.get("grid")
    return Frame(
        observation=observation,
        target_id=None if target_label is None else TARGET_ID,
        target_description=_text(raw, "target_description"),
        support_z_m=support_z_m,
        grid=grid_around(points, support_z_m) if grid is None else as_grid(raw.where, grid),
        labels=MappingProxyType({i: label for label, i in ids.items()}),
        names=MappingProxyType({ids[k]: name for k, name in _names(raw).items() if k in ids}),
        support_estimated=estimated,
    )


def save_frame(path: str | Path, frame: Frame) -> None:
    """Writes a frame: a .npz file if the path ends so, else a directory, which is made.

    Labels are written as object ids. A directory rounds depth to 0.1 mm; a .npz file has no names. Raises InputError
    if it cannot be written, or has no label image.
    """
    path, label = Path(path), frame.observation.label_image
    if label is None:
        raise InputError("A frame without a label image cannot be saved.")
    try:
        if path.suffix == ".npz":
            _save_npz(path, frame, label)
        else:
            _save_directory(path, frame, label)
    except OSError as error:
        raise InputError(f"Cannot write the frame to '{path}': {error}.") from error


# --- reading: checks ------------------------------------------------------------------------------------------------


def _clean_depth(raw: RawFrame) -> Float32[np.ndarray, "h w"]:
    """Depth with 0 where there is no reading: NaN and infinity mean that too (as ROS has it)."""
    depth = np.where(np.isfinite(raw.depth_m), raw.depth_m, np.float32(0))
    if (depth < 0).any():
        raise InputError(f"{raw.where}: depth holds negative values; 0 or NaN stand for no reading.")
    if not (depth > 0).any():
        raise InputError(f"{raw.where}: depth is empty: not one pixel has a reading above 0.")
    median = float(np.median(depth[depth > 0]))
    if not 0.02 < median < _MAX_DEPTH_M:
        raise InputError(
            f"{raw.where}: median depth is {median:.4g} m; the unit or scale of the depth is wrong."
        )
    return depth


def _check_camera(raw: RawFrame) -> None:
    K, T, (h, w) = raw.K, raw.T_world_camera, raw.depth_m.shape
    if K[0, 0] <= 0 or K[1, 1] <= 0 or np.abs(K[2] - [0, 0, 1]).max() > 1e-6:
        raise InputError(
            f"{raw.where}, key K: {K.tolist()} are no intrinsics: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]."
        )
    if not (-w < K[0, 2] < 2 * w and -h < K[1, 2] < 2 * h) or not 0.05 * w < K[0, 0] < 50 * w:
        raise InputError(
            f"{raw.where}, key K: {K.tolist()} does not fit images of {w}x{h} pixels. Were they scaled?"
        )
    R = T[:3, :3]
    if np.abs(R @ R.T - np.eye(3)).max() > 1e-3 or np.linalg.det(R) < 0:
        raise InputError(
            f"{raw.where}, camera pose: its upper left 3x3 block is not a rotation. Give the pose of the camera in the "
            "world (p_world = T @ p_camera), without scale or mirror."
        )
    if np.abs(T[3] - [0, 0, 0, 1]).max() > 1e-6 or np.abs(T[:3, 3]).max() > 1000:
        raise InputError(
            f"{raw.where}, camera pose: last row {T[3].tolist()}, position {T[:3, 3].tolist()} m is no pose."
        )


def _special_labels(raw: RawFrame) -> tuple[int, int]:
    default = BACKGROUND if (raw.labels < 0).any() else 0
    found = [
        _whole(raw, key, raw.settings.get(key, d)) for key, d in (("background", default), ("robot", ROBOT))
    ]
    return found[0], found[1]


def _check_labels(raw: RawFrame, present: list[int], background: int) -> None:
    if not present:
        raise InputError(
            f"{raw.where}: labels are {background} (background) everywhere, so there is no object. Give one number per "
            "instance, and `background` if it is another number."
        )
    if present[0] < 0:
        raise InputError(
            f"{raw.where}: label {present[0]} is negative; say which is `background` and which `robot`."
        )


def _target_label(raw: RawFrame, present: list[int]) -> int | None:
    """The target's label, None if it is hidden."""
    given = raw.settings.get("target", 0 if 0 in present else HIDDEN)
    if given == HIDDEN:
        return None
    if isinstance(given, str):
        named = [k for k, name in _names(raw).items() if name == given]
        if not named:
            raise InputError(
                f"{raw.where}, key target: '{given}' is neither '{HIDDEN}' nor one of the names "
                f"{sorted(_names(raw).values())}. Give the target's label."
            )
        given = named[0]
    label = _whole(raw, "target", given)
    if label not in present:
        raise InputError(
            f"{raw.where}, key target: label {label} has no pixel; the labels are {present[:20]}. If the target is not "
            f"in sight, say '{HIDDEN}'."
        )
    return label


def _object_ids(raw: RawFrame, present: list[int], target_label: int | None) -> dict[int, int]:
    """Object id per label."""
    room = MAX_OBJECTS if target_label is not None else MAX_OBJECTS - 1
    if len(present) > room:
        raise InputError(
            f"{raw.where}: {len(present)} instances in labels, but at most {room} fit. Leave out distant or tiny ones."
        )
    others = [k for k in present if k != target_label]
    ids = {k: k for k in others if 0 < k < MAX_OBJECTS}
    free = [i for i in range(1, MAX_OBJECTS) if i not in ids]
    ids |= dict(zip([k for k in others if k not in ids], free))
    if target_label is not None:
        ids[target_label] = TARGET_ID
    return ids


def _relabelled(labels: np.ndarray, ids: Mapping[int, int], robot: int) -> Int16[np.ndarray, "h w"]:
    values, inverse = np.unique(labels, return_inverse=True)
    new = [ids.get(v, ROBOT if v == robot else BACKGROUND) for v in values.tolist()]
    return np.array(new, dtype=np.int16)[inverse].reshape(labels.shape)


def _support(raw: RawFrame, observation: Observation) -> tuple[float, bool]:
    """Height of the support and whether it was estimated; checks that the camera can see the objects on it."""
    points = object_points(observation)
    if len(points) == 0:
        raise InputError(
            f"{raw.where}: no labelled pixel has a depth reading. Are depth and labels of one frame?"
        )
    estimated = "support_z_m" not in raw.settings
    if estimated:
        try:
            support_z_m = estimate_support_z_m(observation)
        except InputError as error:
            raise InputError(f"{raw.where}: {error}{_flip_hint(raw, points)}") from error
    else:
        support_z_m = as_number(raw.where, "support_z_m", raw.settings["support_z_m"])
    camera_z = float(raw.T_world_camera[2, 3])
    if camera_z <= support_z_m:
        raise InputError(
            f"{raw.where}: the camera, at z = {camera_z:.3f} m, is below the support surface, at {support_z_m:.3f} m. "
            f"Check camera pose and support_z_m; the world's z points upwards.{_flip_hint(raw, points)}"
        )
    height = points[:, 2] - support_z_m
    seen = float(np.mean((height > -0.03) & (height < 1.5)))
    if seen < 0.2:
        raise InputError(
            f"{raw.where}: the camera does not see the workspace: only {seen:.0%} of the objects' points lie 0..1.5 m "
            f"above the support at z = {support_z_m:.3f} m (median height {np.median(height):.2f} m). Check "
            f"camera pose, depth scale and support_z_m.{_flip_hint(raw, points)}"
        )
    return support_z_m, estimated


def _flip_hint(raw: RawFrame, points: Float[np.ndarray, "n 3"]) -> str:
    """A hint at the commonest mistake, a pose with OpenGL's camera axes (y up, looking along -z)."""
    if np.median(points[:, 2]) > raw.T_world_camera[2, 3] or raw.T_world_camera[2, 2] > 0.2:
        return (
            " The camera seems to look upwards: is its pose in OpenGL's axes? "
            "Then flip the signs of the matrix's second and third column."
        )
    return ""


def _names(raw: RawFrame) -> dict[int, str]:
    given = raw.settings.get("names", {})
    try:
        return {int(k): str(name)[:_MAX_TEXT] for k, name in given.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f'{raw.where}, key names: need an object of label: name, e.g. {{"3": "red mug"}}.'
        ) from error


def _text(raw: RawFrame, key: str) -> str:
    text = raw.settings.get(key, "")
    if not isinstance(text, str) or len(text) > _MAX_TEXT:
        raise InputError(f"{raw.where}, key {key}: need a text of at most {_MAX_TEXT} characters.")
    return text


def _whole(raw: RawFrame, key: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{raw.where}, key {key}: {value!r} is not a whole number.")
    return value


# --- writing --------------------------------------------------------------------------------------------------------


def _save_npz(path: Path, frame: Frame, label: np.ndarray) -> None:
    o = frame.observation
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        rgb=o.rgb,
        depth_m=o.depth_m,
        K=o.K,
        T_world_camera=o.T_world_camera,
        labels=label,
        background=BACKGROUND,
        robot=ROBOT,
        target=HIDDEN if frame.target_id is None else frame.target_id,
        target_description=frame.target_description,
        support_z_m=frame.support_z_m,
        grid_origin=frame.grid.origin,
        grid_voxel_size_m=frame.grid.voxel_size_m,
        grid_shape=np.array(frame.grid.shape),
    )


def _save_directory(path: Path, frame: Frame, label: np.ndarray) -> None:
    o = frame.observation
    if o.depth_m.max() > 65535 * _DEPTH_UNIT_M:
        raise InputError("Depth beyond 6.5 m does not fit depth.png; save this frame as .npz.")
    path.mkdir(parents=True, exist_ok=True)
    pixels = np.where(label >= 0, label, np.where(label == ROBOT, _ROBOT_PIXEL, _BACKGROUND_PIXEL)).astype(
        np.uint8
    )
    Image.fromarray(o.rgb).save(path / "rgb.png")
    Image.fromarray(np.round(o.depth_m / _DEPTH_UNIT_M).astype(np.uint16)).save(path / "depth.png")
    Image.fromarray(pixels).save(path / "labels.png")
    data = {
        "version": 1,
        "K": o.K.tolist(),
        "camera_pose": o.T_world_camera.tolist(),
        "depth_scale_m": _DEPTH_UNIT_M,
        "background": _BACKGROUND_PIXEL,
        "robot": _ROBOT_PIXEL,
        "target": HIDDEN if frame.target_id is None else frame.target_id,
        "target_description": frame.target_description,
        "support_z_m": frame.support_z_m,
        "names": {str(i): name for i, name in frame.names.items()},
        "grid": {
            "origin": frame.grid.origin.tolist(),
            "voxel_size_m": frame.grid.voxel_size_m,
            "shape": list(frame.grid.shape),
        },
    }
    (path / "frame.json").write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")

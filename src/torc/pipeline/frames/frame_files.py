"""Turn stored frames into frames ready for the pipeline; refuse implausible ones with the likely cause."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np
from jaxtyping import Float, Float32, Int16

from torc.errors import InputError
from torc.geometry.transforms import masked_points
from torc.perception.segmentation import PerceptionConfig
from torc.pipeline.frames.against_picture import doubts
from torc.pipeline.frames.forms import StoredFrame, read_frame
from torc.pipeline.frames.frame import HIDDEN, Frame
from torc.pipeline.frames.level import largest_plane, level_pose
from torc.pipeline.frames.plausibility import clean_depth, intrinsics_doubts
from torc.pipeline.frames.registration import registration_doubt
from torc.pipeline.frames.support_plane import (
    estimate_support_z_m,
    grid_around,
    object_points,
    standing_points,
)
from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT, TARGET_ID, Capture, Observation, VoxelGrid

_RANGE = PerceptionConfig()
_FEWEST_POINTS = 30


def load_frame(path: str | Path) -> Frame:
    """Load an RGB-D frame from an .npz file or a directory; docs/frames.md lists what they may hold.

    Labels from 1 to 63 keep their numbers; the target becomes 0, and other objects get the lowest free id.

    Args:
        path: the file or directory.

    Returns:
        The frame, ready for the pipeline.

    Raises:
        InputError: something cannot be used; the message names file, key and remedy.
    """
    stored = read_frame(Path(path))
    given = stored.settings
    capture, ids, notes = _observed(stored)
    observation = capture.observation
    _check_range(stored.where, capture)
    support_z_m, grid = _support_height(stored.where, capture, given.support_z_m), given.grid
    return Frame(
        observation=observation,
        target_id=TARGET_ID if TARGET_ID in ids.values() else None,
        target_description=given.target_description,
        support_z_m=support_z_m,
        grid=VoxelGrid(np.array(grid.origin), grid.voxel_size_m, grid.shape)
        if grid
        else grid_around(_standing(stored.where, capture, support_z_m), support_z_m),
        labels=MappingProxyType({i: label for label, i in ids.items()}),
        names=MappingProxyType({ids[k]: name for k, name in given.names.items() if k in ids}),
        label_image=capture.label_image,
        support_estimated=given.support_z_m is None,
        warnings=(
            *notes,
            *intrinsics_doubts(observation.K, observation.depth_m.shape),
            *doubts(capture, given.support_z_m),
            *filter(None, [registration_doubt(observation.rgb, observation.depth_m)]),
        ),
    )


def load_capture(path: str | Path, *, level: bool = True) -> Capture:
    """Load what a frame's camera saw, whether or not anything stands in sight. Raises as `load_frame`.

    Without `level` a missing pose is the identity, not estimated.
    """
    return _observed(read_frame(Path(path)), level)[0]


def frame_of(observation: Observation, where: str = "The snapshot") -> Frame:
    """Return the frame of a snapshot without masks, as if it had been saved and loaded; `where` begins messages.

    Raises InputError as `load_frame`.
    """
    observation = replace(observation, depth_m=clean_depth(where, observation.depth_m))
    capture = Capture(observation)
    support_z_m = _support_height(where, capture, None)
    grid = grid_around(_standing(where, capture, support_z_m), support_z_m)
    return Frame(observation, None, "", support_z_m, grid, support_estimated=True)


def _observed(stored: StoredFrame, level: bool = True) -> tuple[Capture, dict[int, int], tuple[str, ...]]:
    """Return the snapshot of a file, the object id per label, and notes on how the file was understood.

    A missing pose is estimated.
    """
    given, pose = stored.settings, stored.settings.T_world_camera
    stored, table = without_table(stored)
    ids, label_image = _object_ids(stored)
    observation = Observation(
        stored.rgb,
        stored.depth_m,
        given.K,
        np.eye(4) if pose is None else pose,
        np.zeros(0),
        0.0,
        pair=stored.pair,
        pose_estimated=given.pose_estimated or pose is None,
    )
    capture = Capture(observation, label_image)
    return (_levelled(stored, capture) if pose is None and level else capture), ids, (*stored.notes, *table)


def _levelled(stored: StoredFrame, capture: Capture) -> Capture:
    """Return the snapshot with the pose estimated from the support in the picture.

    Raises InputError if other entries of the frame refer to an unknown world.
    """
    where, given, observation = stored.where, stored.settings, capture.observation
    if capture.label_image is not None:
        raise InputError(
            f"{where}, key T_world_camera: is missing; add it. Only for frames without masks it is estimated."
        )
    if told := [k for k in ("support_z_m", "grid") if getattr(given, k) is not None]:
        raise InputError(
            f"{where}, key {told[0]}: is given in the world, and T_world_camera, the camera's pose in it, is missing. "
            f"Add that; or leave out {' and '.join(told)}: torc then estimates the pose, with the support at z = 0."
        )
    try:
        return Capture(replace(observation, T_world_camera=level_pose(observation), pose_estimated=True))
    except InputError as error:
        raise InputError(
            f"{where}, key T_world_camera: is missing, and cannot be estimated. {error}{_doubts(capture)}"
        ) from error


def _object_ids(stored: StoredFrame) -> tuple[dict[int, int], Int16[np.ndarray, "h w"] | None]:
    """Return the object id per label, and per pixel; {} and None without masks.

    The target becomes 0, others keep 1..63 or get the lowest free id. Raises InputError for labels without an object,
    negative ones, too many, and a target that is not among them.
    """
    given, where = stored.settings, stored.where
    if stored.labels is None:
        if given.target not in (None, HIDDEN):
            raise InputError(
                f"{where}, key target: {given.target!r} is a label, and the frame has no masks (labels.png, or the key "
                "labels). Give those, or say which object it is by --mark or --reference."
            )
        return {}, None
    background = given.background
    if background is None:
        background = BACKGROUND if (stored.labels < 0).any() else 0
    values, inverse = np.unique(stored.labels, return_inverse=True)
    present = [k for k in values.tolist() if k not in (background, given.robot)]
    if not present:
        raise InputError(
            f"{where}: labels are {background} (background) everywhere, so there is no object. Give one number per "
            "instance, and `background` if it is another number."
        )
    if present[0] < 0:
        raise InputError(
            f"{where}: label {present[0]} is negative; say which is `background` and which `robot`."
        )
    target = _target_label(stored, present)
    room = MAX_OBJECTS if target is not None else MAX_OBJECTS - 1
    if len(present) > room:
        raise InputError(
            f"{where}: {len(present)} instances in labels, but at most {room} fit. Leave out distant or tiny ones."
        )
    others = [k for k in present if k != target]
    ids = {k: k for k in others if 0 < k < MAX_OBJECTS}
    free = [i for i in range(1, MAX_OBJECTS) if i not in ids]
    ids |= dict(zip([k for k in others if k not in ids], free))
    if target is not None:
        ids[target] = TARGET_ID
    new = [ids.get(v, ROBOT if v == given.robot else BACKGROUND) for v in values.tolist()]
    return ids, np.array(new, dtype=np.int16)[inverse].reshape(stored.labels.shape)


def _target_label(stored: StoredFrame, present: list[int]) -> int | None:
    """Return the target's label, None if it is hidden."""
    given, names = stored.settings.target, stored.settings.names
    if given == HIDDEN:
        return None
    if isinstance(given, str):
        given = next((k for k, name in names.items() if name == given), None)
    label = 0 if stored.settings.target is None else given
    if label not in present:
        named = f", a name of {sorted(names.values())}" if names else ""
        raise InputError(
            f"{stored.where}, key target: {stored.settings.target!r} is no label with a pixel. Give the "
            f"target's label, one of {present[:20]}{named}, or '{HIDDEN}' if it is not in sight."
        )
    return label


def _check_range(where: str, capture: Capture) -> None:
    """Refuse frames whose objects lie mostly outside the range that perception uses."""
    depth_m, label = capture.observation.depth_m, capture.label_image
    if label is None:
        return
    readings = depth_m[(label >= 0) & (depth_m > 0)]
    if len(readings) == 0:
        raise InputError(
            f"{where}: no labelled pixel has a depth reading. Are depth and labels of one frame?"
        )
    near, far = _RANGE.min_depth_m, _RANGE.max_depth_m
    if np.mean((readings >= near) & (readings <= far)) < 0.5:
        raise InputError(
            f"{where}: the objects are {np.median(readings):.2f} m from the camera; readings from {near} to {far:g} m "
            "are used. Check the unit and scale of the depth, or take the picture from within that range."
        )


def _support_height(where: str, capture: Capture, known_z_m: float | None) -> float:
    """Return the height of the support, estimated if unknown; check that the camera can see the objects on it."""
    o, support_z_m = capture.observation, known_z_m
    if support_z_m is None and o.pose_estimated:
        support_z_m = 0.0
    elif support_z_m is None:
        try:
            support_z_m = estimate_support_z_m(capture)
        except InputError as error:
            raise InputError(f"{where}: {error}{_doubts(capture)}") from error
    camera_z_m = o.T_world_camera[2, 3]
    height = object_points(capture)[:, 2] - support_z_m
    seen = float(np.mean((height > -0.03) & (height < 1.5)))
    if camera_z_m <= support_z_m or (capture.label_image is not None and seen < 0.2):
        raise InputError(
            f"{where}: the camera does not see the workspace: it is at z = {camera_z_m:.3f} m, the support surface at "
            f"{support_z_m:.3f} m, and {seen:.0%} of the objects' points lie 0..1.5 m above that (median height "
            f"{np.median(height):.2f} m). Check camera pose, depth scale and support_z_m; the world's z points upwards."
            f"{_doubts(capture, support_z_m)}"
        )
    return support_z_m


def _doubts(capture: Capture, support_z_m: float | None = None) -> str:
    """Return what the picture contradicts, for the end of a message."""
    return "".join(f" {doubt}" for doubt in doubts(capture, support_z_m))


def _standing(where: str, capture: Capture, support_z_m: float) -> Float[np.ndarray, "n 3"]:
    """Return points of what stands on the support. Raises InputError if nothing does."""
    if capture.label_image is not None:
        return object_points(capture)
    observation = capture.observation
    points = standing_points(observation, support_z_m)
    if len(points) < _FEWEST_POINTS:
        raise InputError(
            f"{where}: nothing stands on the support: {len(points)} pixels show anything above the largest level "
            f"surface in sight, at z = {support_z_m:.3f} m, and {np.mean(observation.depth_m > 0):.0%} have a reading "
            "of depth at all. Is the table empty, or does one object fill the picture? If not, check the depth's unit, "
            f"and the camera pose and support_z_m if they are given.{_doubts(capture)}"
        )
    return points


_CANDIDATES = (1, 2)
_LEAST_SHARE = 0.12
"""Least share of the picture that a table takes up."""
_LEAST_ON_PLANE, _MOST_RISING = 0.3, 0.1
"""Least share of a table's pixels on its plane, and most above it. Others may show the floor."""
_FLAT_M = 0.02
_BESIDE = 0.15
"""Width of the examined band around the objects, as a share of the picture's height."""
_ABOVE_SHARE = 0.9
_FEWEST = 200


def without_table(stored: StoredFrame) -> tuple[StoredFrame, tuple[str, ...]]:
    """Return the frame with the table as background, and a message about it; unchanged if the labels have no table.

    Raises InputError if the table is the target.
    """
    labels, given = stored.labels, stored.settings
    if labels is None or given.background not in (None, 0) or labels.min() < 0:
        return stored, ()
    table = next((k for k in _CANDIDATES if _is_table(labels, k, stored.depth_m, given.K)), None)
    if table is None:
        return stored, ()
    if given.target == table:
        raise InputError(
            f"{stored.where}, key target: label {table} is the table: it is flat and the other objects stand on it. "
            "Give the label of an object."
        )
    also = np.isin(labels, range(1, table + 1))
    message = (
        f"Label {table} is taken for the table, and so for background: it is flat, and the others stand on it. If it "
        "is an object, give it a number above 2."
    )
    return replace(stored, labels=np.where(also, 0, labels)), (message,)


def _is_table(
    labels: np.ndarray, number: int, depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]
) -> bool:
    """Check whether a label is large and flat, and the labels above it stand on it."""
    mask, others = (labels == number) & (depth_m > 0), (labels > number) & (depth_m > 0)
    if mask.sum() < max(_FEWEST, _LEAST_SHARE * labels.size) or others.sum() < _FEWEST // 4:
        return False
    reach = np.ones((int(_BESIDE * labels.shape[0]),) * 2, np.uint8)
    beside = mask & (cv2.dilate(others.astype(np.uint8), reach) > 0)  # elsewhere it may be the floor
    if beside.sum() < _FEWEST:
        return False
    plane, on_it = largest_plane(_some_points(beside, depth_m, K))
    if on_it.mean() < _LEAST_ON_PLANE:
        return False
    rises = plane.heights(_some_points(beside, depth_m, K)) > _FLAT_M
    above = plane.heights(_some_points(others, depth_m, K)) > -_FLAT_M
    return bool(rises.mean() < _MOST_RISING and above.mean() > _ABOVE_SHARE)


def _some_points(mask: np.ndarray, depth_m: np.ndarray, K: np.ndarray) -> Float[np.ndarray, "n 3"]:
    points = masked_points(mask, depth_m, K, np.eye(4))
    return points[:: max(1, len(points) // 4000)]

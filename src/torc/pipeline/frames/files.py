"""Reading and writing frames, whatever their form; what makes no sense is refused with its likely cause."""

from pathlib import Path
from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Float32, Int16

from torc.errors import InputError
from torc.perception.segmentation import PerceptionConfig
from torc.pipeline.frames.forms import HIDDEN, Frame, StoredFrame, read_frame, write_frame
from torc.pipeline.frames.support_plane import estimate_support_z_m, grid_around, object_points
from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT, TARGET_ID, Observation, VoxelGrid

_RANGE = PerceptionConfig()
_MAX_MEDIAN_DEPTH_M = 30.0
"""Beyond this the unit is wrong: millimetres taken for metres."""


def load_frame(path: str | Path) -> Frame:
    """The frame at a .npz file or directory; the package's text says what they hold.

    Labels keep their numbers where those are 1..63; the target becomes 0, and every other object gets the lowest id
    that is free. Raises InputError, naming file, key and remedy, for whatever cannot be used.
    """
    stored = read_frame(Path(path))
    given = stored.settings
    depth_m = _clean_depth(stored)
    _check_camera(stored)
    ids, label_image = _object_ids(stored)
    observation = Observation(
        stored.rgb, depth_m, given.K, given.T_world_camera, np.zeros(0), 0.0, label_image=label_image
    )
    _check_range(stored.where, observation)
    support_z_m, grid = _support_height(stored, observation), given.grid
    return Frame(
        observation=observation,
        target_id=TARGET_ID if TARGET_ID in ids.values() else None,
        target_description=given.target_description,
        support_z_m=support_z_m,
        grid=VoxelGrid(np.array(grid.origin), grid.voxel_size_m, grid.shape)
        if grid
        else grid_around(object_points(observation), support_z_m),
        labels=MappingProxyType({i: label for label, i in ids.items()}),
        names=MappingProxyType({ids[k]: name for k, name in given.names.items() if k in ids}),
        support_estimated=given.support_z_m is None,
    )


def save_frame(path: str | Path, frame: Frame) -> None:
    """Writes a frame: a .npz file if the path ends so, else a directory, which is made.

    Labels are written as object ids. A directory rounds depth to 0.1 mm; a .npz file has no names. Raises InputError
    if it cannot be written, or has no label image.
    """
    label = frame.observation.label_image
    if label is None:
        raise InputError("A frame without a label image cannot be saved.")
    try:
        write_frame(Path(path), frame, label)
    except OSError as error:
        raise InputError(f"Cannot write the frame to '{path}': {error}.") from error


def _clean_depth(stored: StoredFrame) -> Float32[np.ndarray, "h w"]:
    """Depth with 0 where there is no reading: NaN and infinity mean that too (as ROS has it)."""
    depth = np.where(np.isfinite(stored.depth_m), stored.depth_m, np.float32(0))
    if (depth < 0).any():
        raise InputError(f"{stored.where}: depth holds negative values; 0 or NaN stand for no reading.")
    if not (depth > 0).any():
        raise InputError(f"{stored.where}: depth is empty: not one pixel has a reading above 0.")
    median = float(np.median(depth[depth > 0]))
    if not 0.02 < median < _MAX_MEDIAN_DEPTH_M:
        raise InputError(
            f"{stored.where}: median depth is {median:.4g} m; the unit or scale of the depth is wrong."
        )
    return depth


def _check_camera(stored: StoredFrame) -> None:
    """Refuses intrinsics that do not fit the images, and poses that are none."""
    K, T, (h, w) = stored.settings.K, stored.settings.T_world_camera, stored.depth_m.shape
    if K[0, 0] <= 0 or K[1, 1] <= 0 or np.abs(K[2] - [0, 0, 1]).max() > 1e-6:
        raise InputError(
            f"{stored.where}, key K: {K.tolist()} are no intrinsics: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]."
        )
    if not (-w < K[0, 2] < 2 * w and -h < K[1, 2] < 2 * h) or not 0.05 * w < K[0, 0] < 50 * w:
        raise InputError(
            f"{stored.where}, key K: {K.tolist()} does not fit images of {w}x{h} pixels. Were they scaled?"
        )
    R = T[:3, :3]
    rigid = np.abs(R @ R.T - np.eye(3)).max() < 1e-3 and np.linalg.det(R) > 0
    if not rigid or np.abs(T[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise InputError(
            f"{stored.where}, camera pose: its upper left 3x3 block is not a rotation, or its last row not 0, 0, 0, 1. "
            "Give the pose of the camera in the world (p_world = T @ p_camera), without scale or mirror."
        )


def _object_ids(stored: StoredFrame) -> tuple[dict[int, int], Int16[np.ndarray, "h w"]]:
    """Object id per label, and per pixel: the target becomes 0, others keep 1..63 or get the lowest id that is free.

    Raises InputError for labels without an object, negative ones, too many, and a target that is not among them.
    """
    given, where = stored.settings, stored.where
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
    """The target's label, None if it is hidden."""
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


def _check_range(where: str, observation: Observation) -> None:
    """Refuses frames whose objects lie mostly outside of the range that perception uses."""
    label, depth_m = observation.label_image, observation.depth_m
    assert label is not None
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


def _support_height(stored: StoredFrame, observation: Observation) -> float:
    """Height of the support, estimated if not given; checks that the camera can see the objects on it."""
    points, pose = object_points(observation), observation.T_world_camera
    support_z_m, hint = stored.settings.support_z_m, _flip_hint(points, pose)
    try:
        if support_z_m is None:
            support_z_m = estimate_support_z_m(observation)
    except InputError as error:
        raise InputError(f"{stored.where}: {error}{hint}") from error
    height = points[:, 2] - support_z_m
    seen = float(np.mean((height > -0.03) & (height < 1.5)))
    if pose[2, 3] <= support_z_m or seen < 0.2:
        raise InputError(
            f"{stored.where}: the camera does not see the workspace: it is at z = {pose[2, 3]:.3f} m, the support "
            f"surface at {support_z_m:.3f} m, and {seen:.0%} of the objects' points lie 0..1.5 m above that (median "
            f"height {np.median(height):.2f} m). Check camera pose, depth scale and support_z_m; the world's z points "
            f"upwards.{hint}"
        )
    return support_z_m


def _flip_hint(points: Float[np.ndarray, "n 3"], T_world_camera: np.ndarray) -> str:
    """A hint at the commonest mistake, a pose with OpenGL's camera axes (y up, looking along -z)."""
    if np.median(points[:, 2]) > T_world_camera[2, 3] or T_world_camera[2, 2] > 0.2:
        return (
            " The camera seems to look upwards: is its pose in OpenGL's axes? "
            "Then flip the signs of the matrix's second and third column."
        )
    return ""

"""Reading and writing frames, whatever their form; what makes no sense is refused with its likely cause."""

from pathlib import Path
from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.perception.segmentation import PerceptionConfig
from torc.pipeline.frames.forms import FILES, read_directory, read_npz, write_directory, write_npz
from torc.pipeline.frames.labels import label_ids
from torc.pipeline.frames.record import Frame, RawFrame
from torc.pipeline.frames.support_plane import estimate_support_z_m, grid_around, object_points
from torc.records import TARGET_ID, Observation

_RANGE = PerceptionConfig()
_MAX_MEDIAN_DEPTH_M = 30.0
"""Beyond this the unit is wrong: millimetres taken for metres."""


def load_frame(path: str | Path) -> Frame:
    """The frame at a .npz file or directory; the package's text says what they hold.

    Labels keep their numbers where those are 1..63; the target becomes 0, and every other object gets the lowest id
    that is free. Raises InputError, naming file, key and remedy, for whatever cannot be used.
    """
    raw = _read_raw(Path(path))
    depth_m = _clean_depth(raw)
    _check_camera(raw)
    labels = label_ids(raw)
    observation = Observation(
        rgb=raw.rgb,
        depth_m=depth_m,
        K=raw.K,
        T_world_camera=raw.T_world_camera,
        qpos=np.zeros(0),
        stamp_s=0.0,
        label_image=labels.label_image,
    )
    _check_range(raw, observation)
    support_z_m, estimated = _support_height(raw, observation)
    points, given = object_points(observation), raw.settings
    return Frame(
        observation=observation,
        target_id=TARGET_ID if labels.target_visible else None,
        target_description=given.target_description,
        support_z_m=support_z_m,
        grid=given.grid.grid(raw.where) if given.grid else grid_around(points, support_z_m),
        labels=MappingProxyType({i: label for label, i in labels.ids.items()}),
        names=MappingProxyType({labels.ids[k]: name for k, name in given.names.items() if k in labels.ids}),
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
            write_npz(path, frame, label)
        else:
            write_directory(path, frame, label)
    except OSError as error:
        raise InputError(f"Cannot write the frame to '{path}': {error}.") from error


def _read_raw(path: Path) -> RawFrame:
    """The frame at a .npz file or directory. Raises InputError where it cannot be read."""
    if path.is_dir():
        raw = read_directory(path)
    elif not path.exists():
        raise InputError(f"There is no frame '{path}'. Give a .npz file, or a directory with frame.json.")
    elif path.suffix == ".npz":
        raw = read_npz(path)
    else:
        raise InputError(f"'{path}' is neither a .npz file nor a directory with {', '.join(FILES)}.")
    shapes = {"rgb": raw.rgb.shape[:2], "depth": raw.depth_m.shape, "labels": raw.labels.shape}
    if len(set(shapes.values())) != 1:
        sizes = ", ".join(f"{k} {s[1]}x{s[0]}" for k, s in shapes.items())
        raise InputError(f"{raw.where}: image sizes differ ({sizes}). Register all three to one camera.")
    return raw


def _clean_depth(raw: RawFrame) -> Float32[np.ndarray, "h w"]:
    """Depth with 0 where there is no reading: NaN and infinity mean that too (as ROS has it)."""
    depth = np.where(np.isfinite(raw.depth_m), raw.depth_m, np.float32(0))
    if (depth < 0).any():
        raise InputError(f"{raw.where}: depth holds negative values; 0 or NaN stand for no reading.")
    if not (depth > 0).any():
        raise InputError(f"{raw.where}: depth is empty: not one pixel has a reading above 0.")
    median = float(np.median(depth[depth > 0]))
    if not 0.02 < median < _MAX_MEDIAN_DEPTH_M:
        raise InputError(
            f"{raw.where}: median depth is {median:.4g} m; the unit or scale of the depth is wrong."
        )
    return depth


def _check_camera(raw: RawFrame) -> None:
    """Refuses intrinsics that do not fit the images, and poses that are none."""
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


def _check_range(raw: RawFrame, observation: Observation) -> None:
    """Refuses frames whose objects lie mostly outside of the range that perception uses."""
    label, depth_m = observation.label_image, observation.depth_m
    readings = depth_m[(label >= 0) & (depth_m > 0)] if label is not None else depth_m[:0]
    if len(readings) == 0:
        raise InputError(
            f"{raw.where}: no labelled pixel has a depth reading. Are depth and labels of one frame?"
        )
    near, far = _RANGE.min_depth_m, _RANGE.max_depth_m
    if np.mean((readings >= near) & (readings <= far)) < 0.5:
        raise InputError(
            f"{raw.where}: the objects are {np.median(readings):.2f} m from the camera; readings from {near} to "
            f"{far:g} m are used. Check the unit and scale of the depth, or take the picture from within that range."
        )


def _support_height(raw: RawFrame, observation: Observation) -> tuple[float, bool]:
    """Height of the support and whether it was estimated; checks that the camera can see the objects on it."""
    points = object_points(observation)
    support_z_m = raw.settings.support_z_m
    estimated = support_z_m is None
    if support_z_m is None:
        try:
            support_z_m = estimate_support_z_m(observation)
        except InputError as error:
            raise InputError(f"{raw.where}: {error}{_flip_hint(raw, points)}") from error
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

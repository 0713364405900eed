"""Whether depth, camera and support surface make sense together; what does not is refused with its likely cause."""

import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.perception.segmentation import PerceptionConfig
from torc.pipeline.frames.record import RawFrame
from torc.pipeline.frames.support_plane import estimate_support_z_m, object_points
from torc.pipeline.frames.values import as_number
from torc.records import Observation

_RANGE = PerceptionConfig()
_MAX_MEDIAN_DEPTH_M = 30.0
"""Beyond this the unit is wrong: millimetres taken for metres."""


def clean_depth(raw: RawFrame) -> Float32[np.ndarray, "h w"]:
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


def check_camera(raw: RawFrame) -> None:
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


def check_range(raw: RawFrame, observation: Observation) -> None:
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


def support_height(raw: RawFrame, observation: Observation) -> tuple[float, bool]:
    """Height of the support and whether it was estimated; checks that the camera can see the objects on it."""
    points = object_points(observation)
    estimated = "support_z_m" not in raw.settings
    if estimated:
        try:
            support_z_m = estimate_support_z_m(observation)
        except InputError as error:
            raise InputError(f"{raw.where}: {error}{_flip_hint(raw, points)}") from error
    else:
        support_z_m = as_number(raw.key("support_z_m"), raw.settings["support_z_m"])
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

"""Check what was given with a picture against the picture: the camera's pose, the support, the depth."""

import cv2
import numpy as np
from jaxtyping import Float, Float32

from torc.errors import InputError
from torc.geometry.transforms import Pose, invert, rotation_from_wxyz, wxyz_from_rotation
from torc.pipeline.frames.level import Plane, largest_plane, level_plane, sampled_points
from torc.pipeline.frames.support_plane import level_heights, level_share
from torc.records import Capture, Observation

_TABLE_TOP_M = (0.2, 2.5)
"""Median depth of pictures of supports. Other pictures are scaled to 1 m before a support is looked for."""
_LEVEL_DEG = 10.0
_TILTED_DEG = 15.0
"""A pose that tilts the support by more than this is doubtful."""
_OFF_M = 0.05
_SAME_M = 0.02
_FACTORS = (4.0, 5.0, 10.0, 1000.0)
_FACTOR_TOLERANCE = 0.17
_LEAST_LEVEL, _LARGER = 0.02, 3.0
"""Least share of the level pixels at the given height; a surface above it is at most `_LARGER` times larger."""
_BIN_DEPTH_M = 0.5
_USUAL_DISTANCE_M = (0.2, 2.5)
"""From a support to the camera above it."""
_DEEPEST_M = 1.0

_SAMPLES, _FEWEST_POINTS = 2500, 100
_FARTHEST = 3.0
"""Multiple of the median depth beyond which points do not count as to distances along rays."""
_FLATTER, _LEAST_SHARE = 1.3, 0.2
"""The largest plane must grow by this factor, to this share of the points.

On simulated pictures with good depth it grows by 1.0 at most, and by 1.2 where clutter fills the picture; from
distances along rays it mostly grows more than twofold.
"""


def support_in_picture(observation: Observation) -> Plane | None:
    """Find the support from the picture alone; None if none is found. A wrong unit of depth does not hide it."""
    depth_m = observation.depth_m
    median_m = float(np.median(depth_m[depth_m > 0]))
    low, high = _TABLE_TOP_M
    times = 1.0 if low < median_m < high else median_m
    try:
        plane = level_plane((depth_m / times).astype(np.float32), observation.K)
    except InputError:
        return None
    return Plane(plane.up, times * plane.distance_m)


def tilt_deg(pose: Pose, plane: Plane) -> float:
    """Return how far from level a pose makes the support, in degrees."""
    return float(np.degrees(np.arccos(np.clip(pose[2, :3] @ plane.up, -1, 1))))


def direction_of(where: str, key: str, pose: Pose, observation: Observation) -> tuple[Pose, str]:
    """Return T_world_camera of a pose whose name leaves its direction open, and a message that explains the choice.

    Raises InputError unless exactly one direction makes the support level.
    """
    plane = support_in_picture(observation)
    ways = {"camera to world": pose, "world to camera": invert(pose)}
    level = [way for way, T in ways.items() if plane is not None and tilt_deg(T, plane) < _LEVEL_DEG]
    if len(level) != 1:
        found = "in both directions" if level else "in neither direction"
        why = f"the support is level {found}" if plane is not None else "no support is seen in the picture"
        raise InputError(
            f"{where}, key {key}: it may take points from the camera to the world or back, and the picture does not "
            f"say which: {why}. Call it T_world_camera (p_world = T @ p_camera) or T_camera_world. "
            f"{along_rays_doubt(observation.depth_m, observation.K)}".rstrip()
        )
    return ways[level[0]], (
        f"{key} is read as {level[0]}, since only so the support in the picture is level. Call it "
        f"{'T_world_camera' if level[0] == 'camera to world' else 'T_camera_world'} to be sure."
    )


def doubts(capture: Capture, support_z_m: float | None) -> tuple[str, ...]:
    """Return messages where the picture contradicts its kind of depth, or the given pose, support or depth unit."""
    observation = capture.observation
    if text := along_rays_doubt(observation.depth_m, observation.K):
        return (text,)
    if observation.pose_estimated:
        return ()
    plane = support_in_picture(observation)
    if plane is None:
        return ()
    tilt = tilt_deg(observation.T_world_camera, plane)
    if tilt > _TILTED_DEG:
        return _tilted(observation, plane, tilt)
    if tilt > _LEVEL_DEG or support_z_m is None:
        return ()
    return _height_off(capture, plane, support_z_m)


def _tilted(observation: Observation, plane: Plane, tilt: float) -> tuple[str, ...]:
    """Report a pose that tilts the support, with the usual mistake that explains it.

    Not if a level surface, by the given pose, takes up a good part of the picture: that may be the support, and what
    was taken for it a wall or the side of a box.
    """
    if level_share(observation) > 0.1:
        return ()
    T = observation.T_world_camera
    reordered = T.copy()
    reordered[:3, :3] = rotation_from_wxyz(np.roll(wxyz_from_rotation(T[:3, :3]), 1))
    mistakes = {
        " Its inverse fits: it takes points from the world to the camera; invert it.": invert(T),
        " With OpenCV's camera axes it fits: it is in OpenGL's; flip the signs of its second and third column.": (
            T @ np.diag([1.0, -1.0, -1.0, 1.0])
        ),
        " With the quaternion's order changed it fits: give wxyz, w first; this is xyzw.": reordered,
        " With its angles taken for degrees it fits: convert them once only.": _turned(T, 180 / np.pi),
        " With its angles turned from degrees into radians it fits.": _turned(T, np.pi / 180),
    }
    reason = next((text for text, T in mistakes.items() if tilt_deg(T, plane) < _LEVEL_DEG / 2), "")
    return (
        f"By the camera's pose the largest plane in the picture, which looks like the support, is tilted by {tilt:.0f} "
        f"degrees. Check T_world_camera.{reason}",
    )


def _turned(T: Pose, scale: float) -> Pose:
    """Scale the pose's rotation vector."""
    turned = T.copy()
    turned[:3, :3] = cv2.Rodrigues(scale * cv2.Rodrigues(T[:3, :3])[0])[0]
    return turned


def _height_off(capture: Capture, plane: Plane, support_z_m: float) -> tuple[str, ...]:
    """Report a support_z_m or a unit of depth that does not fit the picture, the likelier cause first."""
    camera_z_m = float(capture.observation.T_world_camera[2, 3])
    camera_m, seen_z_m = camera_z_m - support_z_m, camera_z_m - plane.distance_m
    if camera_m <= 0 or abs(plane.distance_m - camera_m) < _OFF_M:
        return ()
    unit = _fitting_unit(plane.distance_m / camera_m)
    # People leave out the table's height, or give 0 for anything within reach of a robot. The unit is likelier if the
    # depth puts the camera at an unusual distance from the support.
    low, high = _USUAL_DISTANCE_M
    left_out = seen_z_m > support_z_m or (support_z_m == 0 and seen_z_m > -_DEEPEST_M)
    height_first = not unit or (low < plane.distance_m < high and left_out)
    # Depth that is far too small can bring anything to the given height.
    if (height_first or seen_z_m < support_z_m) and _may_be_support(capture, support_z_m, seen_z_m):
        return ()
    if not height_first:
        return (
            f"By pose and support_z_m the camera is {camera_m:.2f} m above the support, by the depth "
            f"{plane.distance_m:.2f} m. The depth's unit is probably wrong: {unit}. If not, check support_z_m.",
        )
    forgotten = " Was the height of the table left out?" if support_z_m == 0 else ""
    instead = (
        f" If these are right, the depth's unit is wrong: {unit}."
        if unit
        else " Check the depth's unit, too."
    )
    return (
        f"The largest level surface in the picture is at z = {seen_z_m:.3f} m, not at support_z_m = "
        f"{support_z_m:.3f} m.{forgotten} Check support_z_m and the camera's pose.{instead}",
    )


def _may_be_support(capture: Capture, support_z_m: float, seen_z_m: float) -> bool:
    """Check whether a level surface lies at the given height, and is not just the floor around the largest one.

    A bin's may be smaller than the table that it stands on.
    """
    above_m = seen_z_m - support_z_m
    if above_m > _BIN_DEPTH_M:
        return False
    heights = level_heights(capture)
    given, largest = (
        np.count_nonzero(np.abs(heights - z) < _SAME_M) / max(len(heights), 1)
        for z in (support_z_m, seen_z_m)
    )
    return bool(given > _LEAST_LEVEL and not (above_m > 0 and largest > _LARGER * given))


def _fitting_unit(ratio: float) -> str:
    """Return the change of unit that corrects depth that is too large by this ratio; "" if no usual one does."""
    off = max(ratio, 1 / ratio)
    factor = min(_FACTORS, key=lambda f: abs(np.log(off / f)))
    if abs(np.log(off / factor)) > _FACTOR_TOLERANCE:
        return ""
    return f"it would fit with a depth_scale {'smaller' if ratio > 1 else 'larger'} by a factor of {factor:g}"


def along_rays_doubt(depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]) -> str:
    """Return a message if the largest plane grows once depth is read as distances along the rays; else "".

    Planes are bowls if the depth is such a distance, and flat once it is converted.
    """
    points, _ = sampled_points(depth_m, K, _SAMPLES)
    points = points[points[:, 2] < _FARTHEST * np.median(points[:, 2])] if len(points) else points
    if len(points) < _FEWEST_POINTS:
        return ""
    along_ray = np.linalg.norm(points, axis=1) / points[:, 2]
    as_given, converted = _share_in_plane(points), _share_in_plane(points / along_ray[:, None])
    if converted < max(_LEAST_SHARE, _FLATTER * as_given):
        return ""
    return (
        "The depth seems to be the distance along each pixel's ray (Gazebo, Blender and some time-of-flight cameras "
        f"give that), not along the optical axis: {as_given:.0%} of it lies in one plane as it is, {converted:.0%} "
        "once converted. To convert it, divide it by sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2), where u is a "
        "pixel's column and v its row."
    )


def _share_in_plane(points: Float[np.ndarray, "n 3"]) -> float:
    """Return the largest share of the points in one plane, to within .6 % of their depth."""
    plane, inside = largest_plane(points, near_m=0.0, tries=200, from_above=False)
    near_fit = np.abs(plane.heights(points)) < 0.006 * points[:, 2]
    return float(max(inside.mean(), near_fit.mean() if inside.any() else 0.0))

"""Estimate a camera pose from the picture alone: the largest plane in it is assumed to be a level support.

For frames without a known camera pose. The world then has its origin on the support below the camera, x where the
camera looks, z up. The plane is found by RANSAC (Fischler and Bolles 1981); pixels in the middle of the picture and
near ones count more.
"""

import numpy as np
from jaxtyping import Bool, Float, Float32

from torc.errors import InputError
from torc.geometry.transforms import Pose, make_pose
from torc.records import Observation

_SAMPLES, _TRIES = 6000, 400
_NEAR_M, _NEAR_SHARE = 0.006, 0.006
"""A point belongs to a plane if it is within this distance, or this share of its depth."""
_MOST_M = 3.0
_LEAST_SHARE = 0.15
"""Least share, by weight, of the readings within _MOST_M that lie on the plane."""
_STEEPEST = 0.17
"""Sine of the least angle between the camera's view and the plane: 10 degrees."""
_STRAIGHT_DOWN = 0.1
"""Sine of the largest angle between the camera's view and the plumb line that counts as straight down."""


def level_pose(observation: Observation) -> Pose:
    """Return T_world_camera from the support in the picture, at z = 0; the observation's own pose is ignored.

    Raises InputError if no plane takes up enough of the picture, or is seen from above.
    """
    points, weights = _sampled(observation.depth_m, observation.K)
    if len(points) < 100:
        raise InputError(
            "The depth has too few readings within 3 m to find the support in it. Give the camera's pose."
        )
    plane, inside = _best_plane(points, weights)
    share = float(weights[inside].sum() / weights.sum())
    if share < _LEAST_SHARE:
        raise InputError(
            f"No support was found in the picture: the largest plane takes up {share:.0%} of it. Give the camera's "
            "pose, or take the picture from further above."
        )
    plane = _fitted(points[inside], weights[inside])
    up, height = plane[:3], float(plane[3])
    x = _ahead(up)
    R_camera_world = np.stack([x, np.cross(up, x), up], axis=1)
    return make_pose(R_camera_world.T, [0.0, 0.0, height])


def largest_plane(
    points: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "3"], float, Bool[np.ndarray, "n"]]:
    """Find the plane that most points lie on; points are in the camera's frame.

    Returns:
        Its unit normal towards the camera, the camera's distance, and which points lie on it.
    """
    _, inside = _best_plane(points, np.ones(len(points)))
    plane = _fitted(points[inside], np.ones(int(inside.sum())))
    return plane[:3], float(plane[3]), inside


def _ahead(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Return the unit vector along the support, in the camera's frame, where the camera looks, however it is rolled.

    If it looks straight down: where the upper edge of its picture points.
    """
    for axis in ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]):
        along = np.array(axis) - up * (up @ axis)
        length = float(np.linalg.norm(along))
        if length > _STRAIGHT_DOWN:
            break
    return along / length


def _sampled(
    depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Return points in the camera's frame and their weights, sampled evenly over the picture."""
    step = max(1, int(np.sqrt(depth_m.size / _SAMPLES)))
    rows, cols = np.mgrid[: depth_m.shape[0] : step, : depth_m.shape[1] : step]
    z = depth_m[::step, ::step].astype(float)
    with np.errstate(invalid="ignore"):
        good = (z > 0) & (z < _MOST_M)
    points = np.stack([(cols - K[0, 2]) / K[0, 0] * z, (rows - K[1, 2]) / K[1, 1] * z, z], axis=-1)
    v, u = (2 * n / max(size - 1, 1) - 1 for n, size in zip((rows, cols), depth_m.shape))
    # A wall behind a table may fill more of the picture than the table does.
    return points[good], np.exp(-1.5 * (u**2 + v**2))[good] / z[good] ** 1.5


def _best_plane(
    points: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "4"], Bool[np.ndarray, "n"]]:
    """Return the best plane (unit normal towards the camera, the camera's distance) and which points lie on it."""
    rng = np.random.default_rng(0)
    best, plane, inside = -1.0, np.zeros(4), np.zeros(len(points), bool)
    near = np.maximum(_NEAR_M, _NEAR_SHARE * points[:, 2])
    for a, b, c in points[rng.integers(0, len(points), (_TRIES, 3))]:
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal)
        if length < 1e-9:
            continue
        normal /= length if normal @ a < 0 else -length
        on = np.abs((points - a) @ normal) < near
        score = float(weights[on].sum())
        # A support is seen from above: its normal partly points up, or back at the camera.
        if score > best and max(-normal[1], -normal[2]) > _STEEPEST:
            best, plane, inside = score, np.array([*normal, -float(normal @ a)]), on
    return plane, inside


def _fitted(points: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, "n"]) -> Float[np.ndarray, "4"]:
    """Fit a plane to points by least squares."""
    middle = np.average(points, axis=0, weights=weights)
    _, _, axes = np.linalg.svd((points - middle) * np.sqrt(weights)[:, None], full_matrices=False)
    normal = axes[2] if axes[2] @ middle < 0 else -axes[2]
    return np.array([*normal, -float(normal @ middle)])

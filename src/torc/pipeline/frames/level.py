"""Find the plane of the support in a picture, and the camera's pose from it: it is assumed to be level.

For frames without a known camera pose. The world then has its origin on the support below the camera, x where the
camera looks, z up. The plane is found by RANSAC (Fischler and Bolles 1981); pixels in the middle of the picture and
near ones count more.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Float32

from torc.errors import InputError
from torc.geometry.transforms import Pose, make_pose
from torc.records import Observation

_SAMPLES = 6000
_NEAR_M, _NEAR_SHARE = 0.006, 0.006
"""A point belongs to a plane if it is within this distance, or this share of its depth."""
_MOST_M = 3.0
_LEAST_SHARE = 0.15
"""Least share, by weight, of the readings within _MOST_M that lie on the plane."""
_STEEPEST = 0.17
"""Sine of the least angle between the camera's view and the plane: 10 degrees."""
_STRAIGHT_DOWN = 0.1
"""Sine of the largest angle between the camera's view and the plumb line that counts as straight down."""


class Plane(NamedTuple):
    """A plane in the camera's frame: its unit normal towards the camera, and the camera's distance from it."""

    up: Float[np.ndarray, "3"]
    distance_m: float

    def heights(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """Return how far points lie above the plane."""
        return points @ self.up + self.distance_m


def level_pose(observation: Observation) -> Pose:
    """Return T_world_camera from the support in the picture, at z = 0; the observation's own pose is ignored.

    Raises InputError if no plane takes up enough of the picture, or is seen from above.
    """
    up, height_m = level_plane(observation.depth_m, observation.K)
    # x: where the camera looks, or if it looks straight down, where the upper edge of its picture points.
    for axis in ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]):
        along = np.array(axis) - up * (up @ axis)
        length = float(np.linalg.norm(along))
        if length > _STRAIGHT_DOWN:
            break
    x = along / length
    return make_pose(np.stack([x, np.cross(up, x), up]), [0.0, 0.0, height_m])


def level_plane(depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]) -> Plane:
    """Return the support in a picture. Raises as `level_pose`."""
    points, off_centre = sampled_points(depth_m, K, _SAMPLES)
    within = points[:, 2] < _MOST_M
    points = points[within]
    if len(points) < 100:
        raise InputError(
            "The depth has too few readings within 3 m to find the support in it. Give the camera's pose."
        )
    # A wall behind a table may fill more of the picture than the table does.
    weights = np.exp(-1.5 * off_centre[within]) / points[:, 2] ** 1.5
    plane, inside = largest_plane(points, weights)
    share = float(weights[inside].sum() / weights.sum())
    if share < _LEAST_SHARE:
        raise InputError(
            f"No support was found in the picture: the largest plane takes up {share:.0%} of it. Give the camera's "
            "pose, or take the picture from further above."
        )
    return plane


def sampled_points(
    depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"], samples: int
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Return points in the camera's frame, sampled evenly over the picture, and how far off its middle each is seen.

    That is the square of the distance, in halves of the picture's width and height.
    """
    step = max(1, int(np.sqrt(depth_m.size / samples)))
    rows, cols = np.mgrid[: depth_m.shape[0] : step, : depth_m.shape[1] : step]
    z = depth_m[::step, ::step].astype(float)
    points = np.stack([(cols - K[0, 2]) / K[0, 0] * z, (rows - K[1, 2]) / K[1, 1] * z, z], axis=-1)
    v, u = (2 * n / max(size - 1, 1) - 1 for n, size in zip((rows, cols), depth_m.shape))
    return points[z > 0], (u**2 + v**2)[z > 0]


def largest_plane(
    points: Float[np.ndarray, "n 3"],
    weights: Float[np.ndarray, "n"] | None = None,
    *,
    near_m: float = _NEAR_M,
    tries: int = 400,
    from_above: bool = True,
) -> tuple[Plane, Bool[np.ndarray, "n"]]:
    """Find the plane that most points lie on, by weight, and which these are; points are in the camera's frame.

    With `from_above` it must be a support: its normal partly points up, or back at the camera.
    """
    rng = np.random.default_rng(0)
    weights = np.ones(len(points)) if weights is None else weights
    best, inside = -1.0, np.zeros(len(points), bool)
    near = np.maximum(near_m, _NEAR_SHARE * points[:, 2])
    for a, b, c in points[rng.integers(0, len(points), (tries, 3))]:
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal)
        if length < 1e-9:
            continue
        normal /= length if normal @ a < 0 else -length
        on = np.abs((points - a) @ normal) < near
        score = float(weights[on].sum())
        if score > best and (not from_above or max(-normal[1], -normal[2]) > _STEEPEST):
            best, inside = score, on
    if not inside.any():
        return Plane(np.zeros(3), 0.0), inside
    return _fitted(points[inside], weights[inside]), inside


def _fitted(points: Float[np.ndarray, "n 3"], weights: Float[np.ndarray, "n"]) -> Plane:
    """Fit a plane to points by least squares."""
    middle = np.average(points, axis=0, weights=weights)
    _, _, axes = np.linalg.svd((points - middle) * np.sqrt(weights)[:, None], full_matrices=False)
    normal = axes[2] if axes[2] @ middle < 0 else -axes[2]
    return Plane(normal, -float(normal @ middle))

"""Detect depth that is the distance along each pixel's ray: its planes are bowls, and flat once it is converted."""

import numpy as np
from jaxtyping import Bool, Float, Float32

_SAMPLES, _TRIES = 2500, 200
_FEWEST_POINTS = 100
_FARTHEST = 3.0
"""Multiple of the median depth beyond which points do not count."""
_NEAR_SHARE = 0.006
"""A point belongs to a plane if it is within this share of its depth."""
_FLATTER, _LEAST_SHARE = 1.3, 0.2
"""The largest plane must grow by this factor, to this share of the points.

On simulated pictures with good depth it grows by 1.0 at most, and by 1.2 where clutter fills the picture; from
distances along rays it mostly grows more than twofold.
"""


def along_rays_doubt(depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]) -> str:
    """Return a message if the largest plane grows once depth is read as distances along the rays; else ""."""
    rays, z = _sampled(depth_m, K)
    if len(z) < _FEWEST_POINTS:
        return ""
    lengths = np.linalg.norm(rays, axis=1)
    as_given = _share_in_plane(rays * z[:, None], _NEAR_SHARE * z)
    converted = _share_in_plane(rays * (z / lengths)[:, None], _NEAR_SHARE * z / lengths)
    if converted < max(_LEAST_SHARE, _FLATTER * as_given):
        return ""
    return (
        "The depth seems to be the distance along each pixel's ray (Gazebo, Blender and some time-of-flight cameras "
        f"give that), not along the optical axis: {as_given:.0%} of it lies in one plane as it is, {converted:.0%} "
        "once converted. To convert it, divide it by sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2), where u is a "
        "pixel's column and v its row."
    )


def _sampled(
    depth_m: Float32[np.ndarray, "h w"], K: Float[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n"]]:
    """Return rays with z = 1 and the depth along them, sampled evenly over the picture."""
    step = max(1, int(np.sqrt(depth_m.size / _SAMPLES)))
    rows, cols = np.mgrid[: depth_m.shape[0] : step, : depth_m.shape[1] : step]
    z = depth_m[::step, ::step].astype(float)
    rays = np.stack([(cols - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1], np.ones(z.shape)], axis=-1)
    good = z > 0
    if good.any():
        good &= z < _FARTHEST * np.median(z[good])
    return rays[good], z[good]


def _share_in_plane(points: Float[np.ndarray, "n 3"], near_m: Float[np.ndarray, "n"]) -> float:
    """Return the largest share of the points in one plane, by RANSAC and least squares."""
    corners = points[np.random.default_rng(0).integers(0, len(points), (_TRIES, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    real = lengths > 0
    normals = normals[real] / lengths[real, None]
    offsets = np.einsum("ij,ij->i", normals, corners[real, 0])
    inside = np.abs(points @ normals.T - offsets) < near_m[:, None]
    best = inside[:, inside.sum(axis=0).argmax()] if len(normals) else np.zeros(len(points), bool)
    return max(float(best.mean()), _share_near_fit(points, near_m, best))


def _share_near_fit(
    points: Float[np.ndarray, "n 3"], near_m: Float[np.ndarray, "n"], inside: Bool[np.ndarray, "n"]
) -> float:
    """Return the share of the points near the plane that best fits those inside."""
    if np.count_nonzero(inside) < 3:
        return 0.0
    middle = points[inside].mean(axis=0)
    normal = np.linalg.svd(points[inside] - middle, full_matrices=False)[2][2]
    return float(np.mean(np.abs((points - middle) @ normal) < near_m))

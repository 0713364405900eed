"""Find how a solid of convex pieces rests on a table, and whether it rolls."""

from collections.abc import Sequence

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from torc.geometry.transforms import rotation_about

_STEADY_RAD = np.deg2rad(4.0)
"""A pose is a rest if the object must be tilted this far before it falls over."""
_UPRIGHT_RAD = np.deg2rad(0.2)
"""It stands already if it leans less than this: convex pieces are not more exact."""
_UNEVEN = 0.01
"""Corners within this share of the size above a face still bear: pieces of one underside are not quite flush."""
_SAME_FACE_COS = np.cos(np.deg2rad(0.5))
_ROUND = 0.95
"""Least ratio of smallest to largest radius of a cross-section that still rolls."""


def resting_rotation(hulls: Sequence[Float[np.ndarray, "n 3"]]) -> Float[np.ndarray, "3 3"]:
    """Return the smallest rotation to a steady rest on a horizontal table.

    The solid's convex pieces are given by corner points, z up, of one density.
    """
    faces = _steady_faces(hulls)
    if not faces:
        return np.eye(3)
    down = np.array([0.0, 0.0, -1.0])
    normal = max(faces, key=lambda n: float(n @ down))
    axis = np.cross(normal, down)
    sine, cosine = float(np.linalg.norm(axis)), float(normal @ down)
    angle = float(np.arctan2(sine, cosine))
    if angle < _UPRIGHT_RAD:
        return np.eye(3)
    return rotation_about(axis / sine if sine > 1e-9 else (1, 0, 0), angle)


def is_round(hulls: Sequence[Float[np.ndarray, "n 3"]]) -> bool:
    """Check whether the cross-section along some axis of the bounding box, or of inertia, is nearly a circle."""
    points = np.concatenate(list(hulls))
    _, own = np.linalg.eigh(np.cov((points - points.mean(axis=0)).T))
    angles = np.linspace(0.0, np.pi, 24, endpoint=False)
    for axis in (*np.eye(3), *own.T):
        side = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        side /= np.linalg.norm(side)
        directions = np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * np.cross(axis, side)
        reach = points @ directions.T
        widths = np.ptp(reach, axis=0)
        # By equal widths alone a triangle with round sides would pass; its middle is off centre.
        middles = np.abs(reach.max(axis=0) + reach.min(axis=0) - 2 * _middle(points, directions))
        if widths.min() > _ROUND * widths.max() and middles.max() < (1 - _ROUND) * widths.max():
            return True
    return False


def _middle(points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return where the centre of the bounding box across the axis lies along each direction."""
    u, v = directions[0], directions[len(directions) // 2]
    center = sum(0.5 * (float((points @ d).max()) + float((points @ d).min())) * d for d in (u, v))
    return np.asarray(directions @ center)


def _steady_faces(hulls: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return outward normals of the faces of the whole's convex hull on which it rests steadily."""
    points = np.concatenate(list(hulls))
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    solids = [trimesh.convex.convex_hull(piece) for piece in hulls]  # overlaps count twice
    center = np.average([s.center_mass for s in solids], axis=0, weights=[s.volume for s in solids])
    tolerance = _UNEVEN * float(np.ptp(corners, axis=0).max())
    normals: list[np.ndarray] = []
    steady = []
    for equation in hull.equations:
        normal = equation[:3]
        if normals and (np.array(normals) @ normal).max() > _SAME_FACE_COS:
            continue
        normals.append(normal)
        base = corners[corners @ normal + equation[3] > -tolerance]
        height = -float(center @ normal + equation[3])
        if height > 0 and _margin(base, center, normal) > height * np.tan(_STEADY_RAD):
            steady.append(normal)
    return steady


def _margin(base: np.ndarray, center: np.ndarray, normal: np.ndarray) -> float:
    """Return how far inside the base the centre stands, seen along the normal; negative outside."""
    u = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    u /= np.linalg.norm(u)
    plane = np.stack([u, np.cross(normal, u)], axis=1)
    try:
        edges = ConvexHull(base @ plane).equations
    except (QhullError, ValueError):
        return -1.0
    return float(-(edges[:, :2] @ (center @ plane) + edges[:, 2]).max())

"""Propose grasps of an oriented box, the smallest upright one around the completed cloud, from top and sides."""

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.geometry.transforms import kernel_array
from torc.grasping.completion import robust_range, stray_points
from torc.grasping.generators.common import (
    NO_CANDIDATES,
    GeneratorInput,
    RawCandidates,
    drawn,
    make_rotation,
    settled,
)

_YAW_STEP_RAD = np.deg2rad(3.0)
_MAX_POINTS = 250
_SHIFTS = (-0.3, 0.0, 0.3)
_SIDE_TILTS_RAD = tuple(np.deg2rad([45.0, 65.0, 85.0]).tolist())


def propose_boxes(given: GeneratorInput, rng: np.random.Generator) -> RawCandidates:
    """Return grasps along the box's axes: from above at three places, from its near sides at three tilts and places."""
    cloud, config = given.cloud, given.config
    if cloud.visible < given.min_points:
        return NO_CANDIDATES
    axes, center, half = upright_box(cloud.points)
    Rs, tips = [], []
    for closing_axis in (0, 1):
        other = 1 - closing_axis
        along, face = axes[other], axes[closing_axis]
        if 2 * half[closing_axis] > given.hand.max_width_m:
            continue
        for approach in _approaches(along, given):
            R = np.empty((3, 3))
            make_rotation(face, approach, R)
            # Shift along y; the surface is half a box away along the approach.
            reach = abs(along @ approach) * half[other] + abs(approach[2]) * half[2]
            extent_y = abs(along @ R[:, 1]) * half[other] + abs(R[2, 1]) * half[2]
            shifts = center + np.array(_SHIFTS)[:, None] * 2 * extent_y * R[:, 1]
            tips.append(shifts + (np.array(config.depths_m)[:, None, None] - reach) * approach)
            Rs.append(R)
    if not Rs:
        return NO_CANDIDATES
    each = len(config.depths_m) * len(_SHIFTS)
    raw = RawCandidates(np.repeat(Rs, each, axis=0), np.reshape(tips, (-1, 3)), np.zeros(each * len(Rs)))
    return settled(drawn(raw, config.max_raw, rng), given)


def upright_box(
    points: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "2 3"], Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the upright box of least footprint (stray points trimmed): horizontal axes, centre, half sizes."""
    yaws = np.arange(0.0, np.pi / 2, _YAW_STEP_RAD)
    c, s = np.cos(yaws), np.sin(yaws)
    some = points[:: max(1, len(points) // _MAX_POINTS)]
    best, lu, hu, lv, hv = _least_footprint(kernel_array(some), c, s, stray_points(len(some)))
    axes = np.array([[c[best], s[best], 0.0], [-s[best], c[best], 0.0]])
    (lz,), (hz,) = robust_range(points[:, 2:])
    center = (lu + hu) / 2 * axes[0] + (lv + hv) / 2 * axes[1] + np.array([0.0, 0.0, (lz + hz) / 2])
    return axes, center, np.array([hu - lu, hv - lv, hz - lz]) / 2


@njit(cache=True, nogil=True)
def _least_footprint(points, c, s, skip):
    """Return the yaw, by index, at which the rectangle around points is least, and its ranges along both axes.

    `skip` points at either end of a range do not count, at most two.
    """
    best, area, ranges = 0, np.inf, (0.0, 0.0, 0.0, 0.0)
    for k in range(len(c)):
        lu, hu, lv, hv = np.full(3, np.inf), np.full(3, -np.inf), np.full(3, np.inf), np.full(3, -np.inf)
        for i in range(len(points)):
            u, v = points[i, 0] * c[k] + points[i, 1] * s[k], points[i, 1] * c[k] - points[i, 0] * s[k]
            _keep_least(lu, u)
            _keep_least(lv, v)
            _keep_greatest(hu, u)
            _keep_greatest(hv, v)
        found = (hu[skip] - lu[skip]) * (hv[skip] - lv[skip])
        if found < area:
            best, area, ranges = k, found, (lu[skip], hu[skip], lv[skip], hv[skip])
    return best, ranges[0], ranges[1], ranges[2], ranges[3]


@njit(cache=True)
def _keep_least(kept, value):
    """Keep the three least values, rising."""
    if value < kept[2]:
        kept[2] = value
        if value < kept[1]:
            kept[1], kept[2] = value, kept[1]
            if value < kept[0]:
                kept[0], kept[1] = value, kept[0]


@njit(cache=True)
def _keep_greatest(kept, value):
    """Keep the three greatest values, falling."""
    if value > kept[2]:
        kept[2] = value
        if value > kept[1]:
            kept[1], kept[2] = value, kept[1]
            if value > kept[0]:
                kept[0], kept[1] = value, kept[0]


def _approaches(along: np.ndarray, given: GeneratorInput) -> list[np.ndarray]:
    """Return straight down, and along the axis (whichever direction leads forward) at some tilts, if its yaw allows."""
    out = [np.array([0.0, 0.0, -1.0])]
    flat = along if along @ given.forward >= 0 else -along
    if flat @ given.forward >= np.cos(given.config.max_yaw_rad):
        out += [np.sin(t) * flat - np.array([0.0, 0.0, np.cos(t)]) for t in _SIDE_TILTS_RAD]
    return out

"""Propose grasps of an oriented box, the smallest upright one around the completed cloud, from top and sides."""

import numpy as np
from jaxtyping import Float

from torc.grasping.completion import robust_range
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
    u = some[:, :1] * c + some[:, 1:2] * s
    v = some[:, 1:2] * c - some[:, :1] * s
    ranges = [robust_range(w) for w in (u, v)]
    best = int(np.argmin((ranges[0][1] - ranges[0][0]) * (ranges[1][1] - ranges[1][0])))
    axes = np.array([[c[best], s[best], 0.0], [-s[best], c[best], 0.0]])
    (lu, hu), (lv, hv) = ((low[best], high[best]) for low, high in ranges)
    (lz,), (hz,) = robust_range(points[:, 2:])
    center = (lu + hu) / 2 * axes[0] + (lv + hv) / 2 * axes[1] + np.array([0.0, 0.0, (lz + hz) / 2])
    return axes, center, np.array([hu - lu, hv - lv, hz - lz]) / 2


def _approaches(along: np.ndarray, given: GeneratorInput) -> list[np.ndarray]:
    """Return straight down, and along the axis (whichever direction leads forward) at some tilts, if its yaw allows."""
    out = [np.array([0.0, 0.0, -1.0])]
    flat = along if along @ given.forward >= 0 else -along
    if flat @ given.forward >= np.cos(given.config.max_yaw_rad):
        out += [np.sin(t) * flat - np.array([0.0, 0.0, np.cos(t)]) for t in _SIDE_TILTS_RAD]
    return out

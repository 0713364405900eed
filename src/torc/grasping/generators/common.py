"""What generators share: their input, their output, and fitting the jaws to the points between them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.grasping.cells import gather
from torc.grasping.clouds import ObjectCloud
from torc.grasping.config import CandidateConfig
from torc.grasping.hand import FINGER_X, FINGER_Y, FINGER_Z, OPEN, PAD_Y, PAD_Z, HandGeometry


@dataclass(frozen=True)
class GeneratorInput:
    """What a generator may look at.

    Attributes:
        cloud: the object.
        hand: the gripper.
        forward: horizontal direction in which the camera looks; approaches stay within a cone of yaw about it.
        support_z_m: height of the table.
        tip_margin_m: distance of the fingertips to the table.
        min_points: fewest seen points between the pads.
        config: settings.
    """

    cloud: ObjectCloud
    hand: HandGeometry
    forward: Float[np.ndarray, "3"]
    support_z_m: float
    tip_margin_m: float
    min_points: int
    config: CandidateConfig


@dataclass(frozen=True)
class RawCandidates:
    """Unchecked grasps.

    Attributes:
        Rs: rotations, columns closing, y, approach (world frame).
        tips: TCP positions, metres.
        widths_m: expected distance between the closed pads.
    """

    Rs: Float[np.ndarray, "n 3 3"]
    tips: Float[np.ndarray, "n 3"]
    widths_m: Float[np.ndarray, "n"]

    def __len__(self) -> int:
        return len(self.widths_m)


def no_candidates() -> RawCandidates:
    """An empty set."""
    return RawCandidates(np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0))


def drawn(candidates: RawCandidates, limit: int, rng: np.random.Generator) -> RawCandidates:
    """At most `limit` candidates, evenly drawn, in their order."""
    if len(candidates) <= limit:
        return candidates
    keep = np.sort(rng.choice(len(candidates), limit, replace=False))
    return RawCandidates(candidates.Rs[keep], candidates.tips[keep], candidates.widths_m[keep])


@njit(cache=True)
def make_rotation(closing: np.ndarray, approach: np.ndarray, out: np.ndarray) -> None:
    """Rotation with columns closing, approach x closing, approach (unit, perpendicular); closing turned to +y.

    A parallel gripper turned by half a turn about its approach is the same: one of the two is chosen.
    """
    sign = -1.0 if closing[1] < 0.0 or (closing[1] == 0.0 and closing[0] < 0.0) else 1.0
    for k in range(3):
        out[k, 0] = sign * closing[k]
        out[k, 2] = approach[k]
    out[0, 1] = out[1, 2] * out[2, 0] - out[2, 2] * out[1, 0]
    out[1, 1] = out[2, 2] * out[0, 0] - out[0, 2] * out[2, 0]
    out[2, 1] = out[0, 2] * out[1, 0] - out[1, 2] * out[0, 0]


@njit(cache=True)
def lowest_tip_z(R: np.ndarray, sizes: np.ndarray, support_z_m: float, margin_m: float) -> float:
    """Least height of the TCP at which the open fingertips keep `margin_m` from the support."""
    return (
        support_z_m
        + margin_m
        + abs(R[2, 0]) * (0.5 * sizes[OPEN] + sizes[FINGER_X])
        + abs(R[2, 1]) * sizes[FINGER_Y]
    )


@njit(cache=True)
def fit_jaws(
    local: np.ndarray, index: np.ndarray, count: int, seen: np.ndarray, center_x: float, sizes: np.ndarray
) -> tuple[float, float, int]:
    """Extent along the closing axis of the points that closing fingers meet, and the seen points between the pads.

    Points are given in the grasp frame and lie behind the fingertips. Looks at those within half an opening of
    `center_x` and within the fingers' width. Returns (low, high) (low > high: no points), and the count.
    """
    low, high, between = 1e9, -1e9, 0
    half = 0.5 * sizes[OPEN]
    for k in range(count):
        x, y = local[k, 0], local[k, 1]
        if abs(y) > sizes[FINGER_Y] or abs(x - center_x) > half:
            continue
        low, high = min(low, x), max(high, x)
        if seen[index[k]] == 1 and local[k, 2] > -sizes[PAD_Z] and abs(y) < sizes[PAD_Y]:
            between += 1
    return low, high, between


@njit(cache=True)
def settle_on_points(
    points: np.ndarray,
    seen: np.ndarray,
    starts: np.ndarray,
    centers: np.ndarray,
    radii: np.ndarray,
    Rs: np.ndarray,
    tips: np.ndarray,
    limits: np.ndarray,
    min_points: int,
    sizes: np.ndarray,
    widths: np.ndarray,
    keep: np.ndarray,
) -> None:
    """Raise tips off the support, centre them between the points they enclose, and take the width from those.

    `limits` = (support height, tip margin, spread, largest retreat). Writes tips, widths and keep in place.
    """
    local, index = np.empty((len(points), 3)), np.empty(len(points), dtype=np.int64)
    box = np.empty((2, 3))
    box[1, 0], box[1, 1], box[1, 2] = sizes[OPEN], sizes[FINGER_Y], 0.0
    box[0, 0], box[0, 1], box[0, 2] = -sizes[OPEN], -sizes[FINGER_Y], -sizes[FINGER_Z]
    for n in range(len(Rs)):
        R = Rs[n]
        keep[n] = False
        lift = lowest_tip_z(R, sizes, limits[0], limits[1]) - tips[n, 2]
        if lift > 0.0:
            if R[2, 2] > -0.05:
                continue
            back = lift / -R[2, 2]
            if back > limits[3]:
                continue
            tips[n] -= back * R[:, 2]
        count = gather(R, tips[n], box, points, starts, centers, radii, local, index)
        low, high, _ = fit_jaws(local, index, count, seen, 0.0, sizes)
        if high < low or high - low + limits[2] > sizes[OPEN]:
            continue
        middle = 0.5 * (low + high)
        low, high, between = fit_jaws(local, index, count, seen, middle, sizes)
        if (
            between < min_points
            or high - low + limits[2] > sizes[OPEN]
            or abs(low + high - 2 * middle) > 0.004
        ):
            continue
        tips[n] += middle * R[:, 0]
        widths[n] = high - low
        keep[n] = True

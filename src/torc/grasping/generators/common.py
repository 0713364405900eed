"""Shared by generators: their input, their output, and fitting the jaws to the points between them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.grasping.cells import gather
from torc.grasping.clouds import ObjectCloud
from torc.grasping.config import CandidateConfig
from torc.grasping.hand import HandGeometry


@dataclass(frozen=True)
class GeneratorInput:
    """The input of a generator: object, hand, and what limits its grasps.

    Attributes:
        forward: horizontal direction in which the camera looks; approaches stay within a cone of yaw about it.
        tip_margin_m: distance of the fingertips to the table.
        min_points: fewest seen points between the pads.
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

    def __getitem__(self, keep: np.ndarray) -> "RawCandidates":
        return RawCandidates(self.Rs[keep], self.tips[keep], self.widths_m[keep])


NO_CANDIDATES = RawCandidates(np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0))


def drawn(candidates: RawCandidates, limit: int, rng: np.random.Generator) -> RawCandidates:
    """Draw at most `limit` candidates evenly, keeping their order."""
    if len(candidates) <= limit:
        return candidates
    return candidates[np.sort(rng.choice(len(candidates), limit, replace=False))]


def settled(raw: RawCandidates, given: GeneratorInput) -> RawCandidates:
    """Raise candidates off the support, centre them between the points they enclose, and set their widths.

    Those without room or points are left out.
    """
    spread_m, retreat_m = given.config.spread_m, max(given.config.depths_m)
    limits = np.array([given.support_z_m, given.tip_margin_m, spread_m, retreat_m])
    tips, widths, keep = raw.tips.copy(), np.zeros(len(raw)), np.zeros(len(raw), dtype=np.bool_)
    _settle_on_points(given.cloud.cells, raw.Rs, tips, limits, given.min_points, given.hand, widths, keep)
    return RawCandidates(raw.Rs, tips, widths)[keep]


@njit(cache=True)
def make_rotation(closing, approach, out):
    """Write the rotation with columns closing, approach x closing, approach (unit); closing turned to +y.

    Half a turn about its approach does not change a parallel gripper's grasp: one of the two is chosen.
    """
    sign = -1.0 if closing[1] < 0.0 or (closing[1] == 0.0 and closing[0] < 0.0) else 1.0
    for k in range(3):
        out[k, 0] = sign * closing[k]
        out[k, 2] = approach[k]
    out[0, 1] = out[1, 2] * out[2, 0] - out[2, 2] * out[1, 0]
    out[1, 1] = out[2, 2] * out[0, 0] - out[0, 2] * out[2, 0]
    out[2, 1] = out[0, 2] * out[1, 0] - out[1, 2] * out[0, 0]


@njit(cache=True)
def lowest_tip_z(R, hand, support_z_m, margin_m):
    """Return the least height of the TCP at which the open fingertips keep `margin_m` from the support."""
    side = abs(R[2, 0]) * (0.5 * hand.max_width_m + hand.finger_x)
    return support_z_m + margin_m + side + abs(R[2, 1]) * hand.finger_y


@njit(cache=True)
def _fit_jaws(local, index, count, seen, center_x, hand):
    """Return the extent along the closing axis of the points that closing fingers meet.

    Points are given in the grasp frame and lie behind the fingertips. Only those within half an opening of `center_x`
    and within the fingers' width count. Returns (low, high) (low > high: no points), and the seen points between the
    pads.
    """
    low, high, between = 1e9, -1e9, 0
    half = 0.5 * hand.max_width_m
    for k in range(count):
        x, y = local[k, 0], local[k, 1]
        if abs(y) > hand.finger_y or abs(x - center_x) > half:
            continue
        low, high = min(low, x), max(high, x)
        if seen[index[k]] == 1 and local[k, 2] > -hand.pad_z and abs(y) < hand.pad_y:
            between += 1
    return low, high, between


@njit(cache=True, nogil=True)
def _settle_on_points(cells, Rs, tips, limits, min_points, hand, widths, keep):
    """Write tips, widths and keep in place. `limits`: support height, tip margin, spread, largest retreat."""
    support_z, tip_margin, spread, most_back = limits
    local, index = np.empty((len(cells.points), 3)), np.empty(len(cells.points), dtype=np.int64)
    box = (hand.max_width_m, hand.finger_y, -hand.finger_z, 0.0)
    for n in range(len(Rs)):
        R = Rs[n]
        lift = lowest_tip_z(R, hand, support_z, tip_margin) - tips[n, 2]
        if lift > 0.0:
            if R[2, 2] > -0.05:
                continue
            back = lift / -R[2, 2]
            if back > most_back:
                continue
            tips[n] -= back * R[:, 2]
        count = gather(R, tips[n], box, cells, local, index)
        low, high, _ = _fit_jaws(local, index, count, cells.tags, 0.0, hand)
        if high < low or high - low + spread > hand.max_width_m:
            continue
        middle = 0.5 * (low + high)
        low, high, between = _fit_jaws(local, index, count, cells.tags, middle, hand)
        fits = high - low + spread <= hand.max_width_m and abs(low + high - 2 * middle) <= 0.004
        if between < min_points or not fits:
            continue
        tips[n] += middle * R[:, 0]
        widths[n] = high - low
        keep[n] = True

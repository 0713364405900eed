"""Compute features of candidates, compiled. Columns are the first entries of `features.FEATURE_NAMES`."""

import numpy as np
from numba import njit

from torc.grasping.cells import gather
from torc.grasping.hand import between_pads, reach_at

CONTACT_M = 0.008
ALIGNED_COS = 0.87
SLACK_M = 0.003
_FAR_M = 1.0
_LATTICE_M = 0.010
_PALM_LATTICE_M = 0.020


@njit(cache=True, nogil=True)
def candidate_features(Rs, tips, widths, cells, normals, hull, center_view, hand, space, support_z_m, out):
    """Fill the candidates' columns of `out`, row by row.

    `space`: `seen` and `hidden_by` of an OcclusionVolume; the object's bit; origin and voxel size of the grid.
    """
    local, index = np.empty((len(cells.points), 4)), np.empty(len(cells.points), dtype=np.int64)
    # The strip that the fingers close on, from far behind the fingertips to far beyond them.
    strip = (0.5 * hand.max_width_m, max(hand.pad_y, hand.finger_y), -_FAR_M, _FAR_M)
    for n in range(len(widths)):
        R, tip, width, row = Rs[n], tips[n], widths[n], out[n]
        count = gather(R, tip, strip, cells, local, index)
        for k in range(count):
            i = index[k]
            local[k, 3] = R[0, 0] * normals[i, 0] + R[1, 0] * normals[i, 1] + R[2, 0] * normals[i, 2]
        _contacts(local[:count], cells.tags, index, width, hand, row)
        _shape(local[:count], cells.tags, index, width, hand, row)
        _extents(R, tip, hull, row)
        _pose(R, tip, width, center_view, hand, support_z_m, row)
        _unknown(R, tip, width, hand, space, row)


@njit(cache=True)
def _contacts(local, seen_point, index, width, hand, row):
    """Fill columns 0-17 and 28: contacts on either side and points between the pads."""
    half, pad_y, pad_z = 0.5 * width + SLACK_M, hand.pad_y, hand.pad_z
    low, high = 1e9, -1e9
    seen_low, seen_high = 1e9, -1e9
    y_low, y_high, z_low, z_high = 1e9, -1e9, 1e9, -1e9
    seen_between, all_between = 0, 0
    for i in range(len(local)):
        x, y, z = local[i, 0], local[i, 1], local[i, 2]
        if not between_pads(x, y, z, half, pad_y, pad_z):
            continue
        all_between += 1
        low, high = min(low, x), max(high, x)
        y_low, y_high, z_low, z_high = min(y_low, y), max(y_high, y), min(z_low, z), max(z_high, z)
        if seen_point[index[i]] == 1:
            seen_between += 1
            seen_low, seen_high = min(seen_low, x), max(seen_high, x)
    count, aligned = np.zeros((2, 2)), np.zeros((2, 2))
    cosine, depth = np.zeros(2), np.zeros(2)
    box = np.empty((2, 4))
    box[:, 0], box[:, 1], box[:, 2], box[:, 3] = 1e9, -1e9, 1e9, -1e9
    for i in range(len(local)):
        x, y, z = local[i, 0], local[i, 1], local[i, 2]
        if not between_pads(x, y, z, half, pad_y, pad_z):
            continue
        for side in range(2):
            gap = x - low if side == 0 else high - x
            if gap > CONTACT_M:
                continue
            outward = -local[i, 3] if side == 0 else local[i, 3]
            # In thin objects a point is near both extremes: its normal decides which face it is on.
            if outward < -0.2:
                continue
            count[1, side] += 1
            cosine[side] += outward
            depth[side] -= z
            box[side, 0], box[side, 1] = min(box[side, 0], y), max(box[side, 1], y)
            box[side, 2], box[side, 3] = min(box[side, 2], z), max(box[side, 3], z)
            is_aligned = outward > ALIGNED_COS
            if is_aligned:
                aligned[1, side] += 1
            if seen_point[index[i]] == 1:
                count[0, side] += 1
                if is_aligned:
                    aligned[0, side] += 1
    for s in range(2):
        row[2 * s], row[2 * s + 1] = aligned[s].min(), aligned[s].max()
        row[4 + 2 * s], row[5 + 2 * s] = count[s].min(), count[s].max()
    mean = np.empty(2)
    behind = np.empty(2)
    heights, breadths = np.zeros(2), np.zeros(2)
    for side in range(2):
        n = count[1, side]
        mean[side] = cosine[side] / n if n > 0 else -1.0
        behind[side] = depth[side] / n if n > 0 else 0.0
        if n > 0:
            breadths[side], heights[side] = box[side, 1] - box[side, 0], box[side, 3] - box[side, 2]
    row[8], row[9] = mean.min(), mean.max()
    row[10], row[11] = heights.min(), breadths.min()
    row[12], row[13] = behind.mean(), behind.min()
    row[14], row[15] = seen_between, all_between
    row[16] = y_high - y_low if all_between > 0 else 0.0
    row[17] = z_high - z_low if all_between > 0 else 0.0
    row[28] = seen_high - seen_low if seen_between > 0 else 0.0


@njit(cache=True)
def _shape(local, seen_point, index, width, hand, row):
    """Fill columns 18-20: how deep the grasp reaches, and what lies beyond it."""
    first, last = 1e9, -1e9
    beyond_low, beyond_high = 1e9, -1e9
    for i in range(len(local)):
        x, y, z = local[i, 0], local[i, 1], local[i, 2]
        if abs(y) > hand.finger_y:
            continue
        if seen_point[index[i]] == 1:
            first = min(first, z)
        last = max(last, z)
        if z > 0.0:
            beyond_low, beyond_high = min(beyond_low, x), max(beyond_high, x)
    row[18] = -first if first < 1e8 else 0.0
    row[19] = max(last, 0.0)
    row[20] = beyond_high - beyond_low - width if beyond_high > beyond_low else -width


@njit(cache=True)
def _extents(R, tip, hull, row):
    """Fill columns 21-25: extents of the whole object in the grasp frame, and the grasp's place on it."""
    for a in range(3):
        low, high = 1e9, -1e9
        for i in range(len(hull)):
            c = (
                R[0, a] * (hull[i, 0] - tip[0])
                + R[1, a] * (hull[i, 1] - tip[1])
                + R[2, a] * (hull[i, 2] - tip[2])
            )
            low, high = min(low, c), max(high, c)
        row[21 + a] = high - low
        if a < 2:
            row[24 + a] = abs(0.5 * (low + high))


@njit(cache=True)
def _pose(R, tip, width, center_view, hand, support_z_m, row):
    """Fill columns 26, 27 and 29-40: width, lever, directions, heights."""
    row[26], row[27] = width, hand.max_width_m - width
    middle = np.empty(3)
    along = 0.0
    for k in range(3):
        middle[k] = center_view[k] - (tip[k] - 0.5 * hand.pad_z * R[k, 2])
        along += middle[k] * R[k, 0]
    distance = middle[0] ** 2 + middle[1] ** 2 + middle[2] ** 2
    row[29] = np.sqrt(max(0.0, distance - along**2))
    row[30] = np.sqrt(middle[0] ** 2 + middle[1] ** 2)
    row[31] = -middle[2]
    row[32], row[33], row[34] = abs(R[2, 0]), abs(R[2, 1]), -R[2, 2]
    row[35] = R[0, 2] * center_view[3] + R[1, 2] * center_view[4]
    row[36] = abs(R[0, 0] * center_view[3] + R[1, 0] * center_view[4])
    row[37] = tip[2] - support_z_m
    row[38] = row[37] - abs(R[2, 0]) * (0.5 * hand.max_width_m + hand.finger_x) - abs(R[2, 1]) * hand.finger_y
    row[39], row[40] = tip[2] - center_view[6], center_view[7] - tip[2]


@njit(cache=True)
def _unknown_share(R, tip, low, high, space, lattice_m):
    """Return the shares of a box (grasp frame) never seen, and of those, not hidden by the object itself.

    Sampled on a lattice of about `lattice_m`. Space outside the grid counts as seen.
    """
    seen, hidden_by, own_bit, origin, voxel_m = space
    steps = np.empty(3, dtype=np.int64)
    for a in range(3):
        steps[a] = max(1, int(np.ceil((high[a] - low[a]) / lattice_m)))
    total, unknown, other = 0, 0, 0
    for i in range(steps[0]):
        x = low[0] + (high[0] - low[0]) * (i + 0.5) / steps[0]
        for j in range(steps[1]):
            y = low[1] + (high[1] - low[1]) * (j + 0.5) / steps[1]
            for k in range(steps[2]):
                z = low[2] + (high[2] - low[2]) * (k + 0.5) / steps[2]
                total += 1
                u = int(np.floor((tip[0] + R[0, 0] * x + R[0, 1] * y + R[0, 2] * z - origin[0]) / voxel_m))
                v = int(np.floor((tip[1] + R[1, 0] * x + R[1, 1] * y + R[1, 2] * z - origin[1]) / voxel_m))
                w = int(np.floor((tip[2] + R[2, 0] * x + R[2, 1] * y + R[2, 2] * z - origin[2]) / voxel_m))
                if u < 0 or v < 0 or w < 0 or u >= seen.shape[0] or v >= seen.shape[1] or w >= seen.shape[2]:
                    continue
                if not seen[u, v, w]:
                    unknown += 1
                    if hidden_by[u, v, w] & own_bit == 0:
                        other += 1
    return unknown / total, other / total


@njit(cache=True)
def _unknown(R, tip, width, hand, space, row):
    """Fill columns 41-45: unseen share of fingers (closed to open), palm and the space between the pads."""
    low, high = np.empty(3), np.empty(3)
    outer = 0.5 * hand.max_width_m + hand.finger_x
    low[1], high[1], low[2], high[2] = -hand.finger_y, hand.finger_y, -hand.finger_z, 0.0
    low[0], high[0] = -outer, -0.5 * width
    left, left_other = _unknown_share(R, tip, low, high, space, _LATTICE_M)
    low[0], high[0] = 0.5 * width, outer
    right, right_other = _unknown_share(R, tip, low, high, space, _LATTICE_M)
    row[41], row[42], row[43] = max(left, right), 0.5 * (left + right), 0.5 * (left_other + right_other)
    palm, shift_z = hand.palm, -reach_at(hand.reach_m, width)
    total, volume = 0.0, 1e-12
    for k in range(len(palm)):
        for a in range(3):
            low[a], high[a] = palm[k, a] - palm[k, 3 + a], palm[k, a] + palm[k, 3 + a]
        low[2] += shift_z
        high[2] += shift_z
        size = palm[k, 3] * palm[k, 4] * palm[k, 5]
        share, _ = _unknown_share(R, tip, low, high, space, _PALM_LATTICE_M)
        total += size * share
        volume += size
    row[44] = total / volume
    low[0], high[0], low[1], high[1] = -0.5 * width, 0.5 * width, -hand.pad_y, hand.pad_y
    low[2], high[2] = -hand.pad_z, 0.0
    row[45], _ = _unknown_share(R, tip, low, high, space, _LATTICE_M)

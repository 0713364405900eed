"""Compiled passes over depth and label images.

Two neighbouring pixels are *continuous* if their depths differ by at most slope * depth per pixel of distance, with
slope = tan(steepest angle of view) / focal length: a limit on how obliquely a surface may be seen, at any range.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def count_labels(label, most):
    """Return the number of pixels of each label from 0 to below `most`."""
    counts = np.zeros(most, np.int64)
    for k in label.flat:
        if k >= 0:
            counts[k] += 1
    return counts


@njit(cache=True, nogil=True)
def looked_up(table, image):
    """Return table[image], in a fraction of the time that numpy takes."""
    out = np.empty(image.shape, table.dtype)
    for row in range(image.shape[0]):
        for col in range(image.shape[1]):
            out[row, col] = table[image[row, col]]
    return out


@njit(cache=True)
def _edge_point(depth, label, row, col, slope):
    """Check whether a pixel with a reading belongs to no surface, or to another one than its label says.

    A flying point, half way between two surfaces, is torn from the rest of its mask by jumps in depth. So is a pixel
    that shows the neighbour's surface because mask and depth are not aligned to the pixel. Speckles are connected to
    nothing. A true silhouette continues into its own mask, and stays, as do parts two pixels wide.
    """
    height, width = depth.shape
    d = depth[row, col]
    same, torn, joined = 0, 0, 0
    for dr in range(-1, 2):
        for dc in range(-1, 2):
            r, c = row + dr, col + dc
            if (dr == 0 and dc == 0) or r < 0 or c < 0 or r >= height or c >= width or depth[r, c] == 0:
                continue
            own = label[r, c] == label[row, col]
            if abs(depth[r, c] - d) > slope * min(d, depth[r, c]) * (abs(dr) + abs(dc)):
                torn += own
            else:
                joined += 1
                same += own
    return torn >= max(same, 1) or joined < 2


@njit(cache=True)
def find_pieces(depth, label, slope):
    """Return the number of the piece per pixel with a reading in a mask, -1 elsewhere, and how many pieces there are.

    A piece is what is continuous within one mask.
    """
    height, width = depth.shape
    piece = np.full((height, width), -1, np.int32)
    waiting = np.empty((height * width, 2), np.int32)
    count = 0
    for row in range(height):
        for col in range(width):
            if label[row, col] < 0 or depth[row, col] == 0 or piece[row, col] >= 0:
                continue
            piece[row, col] = count
            waiting[0] = row, col
            top = 1
            while top > 0:
                top -= 1
                y, x = waiting[top]
                d = depth[y, x]
                for r in range(max(y - 1, 0), min(y + 2, height)):
                    for c in range(max(x - 1, 0), min(x + 2, width)):
                        if piece[r, c] >= 0 or depth[r, c] == 0 or label[r, c] != label[y, x]:
                            continue
                        if abs(depth[r, c] - d) <= slope * min(d, depth[r, c]) * (abs(r - y) + abs(c - x)):
                            piece[r, c] = count
                            waiting[top] = r, c
                            top += 1
            count += 1
    return piece, count


@njit(cache=True)
def measure_pieces(piece, count, depth, label, inside_px):
    """Return per piece: pixels, label, how far it reaches into its mask, and its least and greatest depth."""
    size, owner, reach = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count, np.float32)
    near_m, far_m = np.full(count, np.inf, np.float32), np.zeros(count, np.float32)
    for row in range(piece.shape[0]):
        for col in range(piece.shape[1]):
            k = piece[row, col]
            if k >= 0:
                size[k] += 1
                owner[k] = label[row, col]
                reach[k] = max(reach[k], inside_px[row, col])
                near_m[k] = min(near_m[k], depth[row, col])
                far_m[k] = max(far_m[k], depth[row, col])
    return size, owner, reach, near_m, far_m


@njit(cache=True)
def surface_pixels(depth, label, wanted, slope):
    """Return row and column of the wanted pixels that have a reading and lie on a surface of their own label."""
    pixels, n = np.empty((depth.size, 2), np.int32), 0
    for row in range(depth.shape[0]):
        for col in range(depth.shape[1]):
            if wanted[row, col] and depth[row, col] > 0 and not _edge_point(depth, label, row, col, slope):
                pixels[n] = row, col
                n += 1
    return pixels[:n].copy()


@njit(cache=True)
def _fit_plane(depth, label, row, col, slope, radius, out):
    """Fit a least-squares plane through the continuous neighbours with an equal label.

    In an image a plane is linear in inverse depth: w(u, v) = w0 + a du + b dv. Fills out with (a, b, w0) and returns
    the mean squared residual relative to w0 squared; -1 if the neighbours do not determine a plane.
    """
    height, width = depth.shape
    d = depth[row, col]
    w_center = 1.0 / d
    n = sx = sy = sxx = sxy = syy = sw = sxw = syw = sww = 0.0
    for r in range(max(row - radius, 0), min(row + radius + 1, height)):
        for c in range(max(col - radius, 0), min(col + radius + 1, width)):
            e = depth[r, c]
            if e == 0 or label[r, c] != label[row, col]:
                continue
            x, y = float(c - col), float(r - row)
            if abs(e - d) > slope * min(d, e) * max(abs(x), abs(y), 1.0):
                continue
            w = 1.0 / e - w_center
            n += 1.0
            sx += x
            sy += y
            sxx += x * x
            sxy += x * y
            syy += y * y
            sw += w
            sxw += x * w
            syw += y * w
            sww += w * w
    if n < 4.0:
        return -1.0
    cxx, cxy, cyy = sxx - sx * sx / n, sxy - sx * sy / n, syy - sy * sy / n
    cxw, cyw = sxw - sx * sw / n, syw - sy * sw / n
    det = cxx * cyy - cxy * cxy
    if det < 1e-6 * n * n:
        return -1.0
    a = (cyy * cxw - cxy * cyw) / det
    b = (cxx * cyw - cxy * cxw) / det
    out[0], out[1], out[2] = a, b, w_center + (sw - a * sx - b * sy) / n
    residual = (sww - sw * sw / n - a * cxw - b * cyw) / n
    return max(residual, 0.0) / (w_center * w_center)


@njit(cache=True)
def _better_fit(planes, residuals, index, depth, pixel, i, radius):
    """Return the pixel whose plane describes pixel i best: its own, or that of a pixel beside it, away from a ridge.

    A window across the ridge of two faces fits neither. A neighbour's window that fits far better and whose plane
    passes through pixel i lies on its face. On curved or noisy surfaces all windows fit alike: nothing changes.
    """
    row, col = pixel[i, 0], pixel[i, 1]
    best, limit = i, 0.1 * residuals[i]
    if limit <= 1e-9:
        return i
    w = 1.0 / depth[row, col]
    for dr in range(-radius, radius + 1, radius):
        for dc in range(-radius, radius + 1, radius):
            r, c = row + dr, col + dc
            if r < 0 or c < 0 or r >= index.shape[0] or c >= index.shape[1]:
                continue
            j = index[r, c]
            if j < 0 or residuals[j] < 0 or residuals[j] >= limit:
                continue
            miss = (planes[j, 2] - planes[j, 0] * dc - planes[j, 1] * dr - w) / w
            if miss * miss <= residuals[i]:
                best, limit = j, residuals[j]
    return best


@njit(cache=True, nogil=True)
def fit_planes(depth, label, pixels, slope, radius, planes, residuals):
    """Write each pixel's plane and its residual, see `_fit_plane`."""
    for i in range(pixels.shape[0]):
        residuals[i] = _fit_plane(depth, label, pixels[i, 0], pixels[i, 1], slope, radius, planes[i])


@njit(cache=True)
def normals_of_planes(planes, residuals, depth, pixels, K, R_world_camera, radius):
    """Return unit normals towards the camera, world frame; the direction to the camera if no plane fits."""
    n = pixels.shape[0]
    index = np.full(depth.shape, -1, np.int32)
    for i in range(n):
        index[pixels[i, 0], pixels[i, 1]] = i
    R = R_world_camera
    normals = np.empty((n, 3), np.float32)
    for i in range(n):
        j = _better_fit(planes, residuals, index, depth, pixels, i, radius) if residuals[i] >= 0 else i
        u, v = pixels[j, 1] - K[0, 2], pixels[j, 0] - K[1, 2]
        if residuals[j] >= 0:
            # n . p = c on the plane, p = depth * ray: 1 / depth = (n / c) . ray, so w's coefficients are the normal.
            x, y = -planes[j, 0] * K[0, 0], -planes[j, 1] * K[1, 1]
            z = -(planes[j, 2] - planes[j, 0] * u - planes[j, 1] * v)
        else:
            x, y, z = -u / K[0, 0], -v / K[1, 1], -1.0
        length = np.sqrt(x * x + y * y + z * z)
        for k in range(3):
            normals[i, k] = (R[k, 0] * x + R[k, 1] * y + R[k, 2] * z) / length
    return normals


@njit(cache=True)
def lift_pixels(depth, pixels, K, T_world_camera):
    """Return world points of pixels. Compiled, because a library's matrix product would wake all its threads."""
    T = T_world_camera
    points = np.empty((pixels.shape[0], 3), np.float32)
    for i in range(pixels.shape[0]):
        z = float(depth[pixels[i, 0], pixels[i, 1]])
        x, y = (pixels[i, 1] - K[0, 2]) / K[0, 0] * z, (pixels[i, 0] - K[1, 2]) / K[1, 1] * z
        for k in range(3):
            points[i, k] = T[k, 0] * x + T[k, 1] * y + T[k, 2] * z + T[k, 3]
    return points


@njit(cache=True, nogil=True)
def heights_within(depth, K, T_world_camera, outline):
    """Return the world's z per pixel; NaN without a reading or outside an outline of rows (least x, y; most x, y)."""
    T, (height, width) = T_world_camera, depth.shape
    out = np.full((height, width), np.nan)
    for row in range(height):
        for col in range(width):
            z = float(depth[row, col])
            if z <= 0:
                continue
            x, y = (col - K[0, 2]) / K[0, 0] * z, (row - K[1, 2]) / K[1, 1] * z
            at_x = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
            at_y = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
            if outline[0, 0] <= at_x <= outline[1, 0] and outline[0, 1] <= at_y <= outline[1, 1]:
                out[row, col] = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
    return out

"""Make the network's input: the part of a picture that may show objects, at about one scale whatever the camera.

A patch is the picture, cut and scaled so that a pixel is about 2 mm wide on what it shows: what is learned from one
camera holds for others. Its channels describe shape first: height above the support, distance along the view, normals,
whether there is a reading; colour comes last. All are in a frame that gravity and the camera's heading define.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8

from torc.geometry.transforms import Pose, kernel_array
from torc.perception.image_kernels import heights_within
from torc.records import VoxelGrid

PIXEL_M = 0.002
"""Approximate width of a pixel on what it shows."""
CHANNELS = 9
"""Height; distance along the heading; the normal to the right, along the heading and up; reading; red, green, blue."""
_HEIGHT_UNIT_M, _AHEAD_UNIT_M = 0.10, 0.15
_BELOW_M, _ABOVE_M = -0.05, 0.45
"""Heights are clipped here."""
_AHEAD_M = 0.6
_SMOOTH_PX = 1.0
_UPSIDE_DOWN = 0.3
"""The camera hangs upside down if the world's z of the picture's downward axis is larger than this."""
_LEAST_M, _MOST_M = 0.004, 0.6
"""Range of heights above the support at which something can be an object."""
NOISE = 3.0
"""What rises less than this many times the support's own roughness is not an object."""
_SUPPORT_M = 0.015
_RIM_M = 0.05
_MOST_PX = 420_000
"""Most pixels of a patch: larger ones are scaled down further."""
_LEAST_SIDE_PX = 96


@dataclass(frozen=True)
class View:
    """A picture with depth as the network's inputs are made from it: any RGB-D picture, or a part of one.

    Attributes:
        depth_m: along the optical axis, 0 for no reading.
        K: intrinsics of this picture, pixels.
        support_z_m: height of the surface that the objects stand on.
    """

    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    K: Float[np.ndarray, "3 3"]
    T_world_camera: Pose
    support_z_m: float


@dataclass(frozen=True)
class Window:
    """The source of a patch: its first row and column in the picture, and the patch's pixels per picture pixel."""

    row: int
    col: int
    scale: float

    def source(self, height: int, width: int) -> tuple[Float32[np.ndarray, "h"], Float32[np.ndarray, "w"]]:
        """Return the picture's rows and columns for the rows and columns of a patch of that size."""
        rows = (np.arange(height) + 0.5) / self.scale - 0.5 + self.row
        cols = (np.arange(width) + 0.5) / self.scale - 0.5 + self.col
        return rows.astype(np.float32), cols.astype(np.float32)


@dataclass(frozen=True)
class Patch:
    """A scaled part of a view.

    Attributes:
        rgb, depth_m: as in the view; 0 for no reading.
        points: in the heading's frame (right, ahead, height above the support), metres; filled in from around where
            there is no reading.
    """

    window: Window
    rgb: UInt8[np.ndarray, "h w 3"]
    depth_m: Float32[np.ndarray, "h w"]
    points: Float32[np.ndarray, "h w 3"]

    @property
    def read(self) -> Bool[np.ndarray, "h w"]:
        """Where there is a reading."""
        return self.depth_m > 0


def hangs_upside_down(T_world_camera: Pose) -> bool:
    """Check whether things that stand upright are upside down in the picture."""
    return bool(T_world_camera[2, 1] > _UPSIDE_DOWN)


def turned_over(view: View) -> View:
    """Return the view of a camera turned by 180 degrees about its optical axis."""
    height, width = view.depth_m.shape
    K, T = view.K.copy(), view.T_world_camera.copy()
    K[0, 2], K[1, 2] = width - 1 - K[0, 2], height - 1 - K[1, 2]
    T[:3, :2] = -T[:3, :2]
    rgb, depth = (np.ascontiguousarray(image[::-1, ::-1]) for image in (view.rgb, view.depth_m))
    return View(rgb, depth, K, T, view.support_z_m)


def window_on(view: View, grid: VoxelGrid, multiple_px: int) -> tuple[Window, int, int] | None:
    """Return where to cut a patch, and its height and width, multiples of `multiple_px`; None if nothing rises.

    Objects stand within the grid's outline.
    """
    rises = rising(view, grid)
    if not rises.any():
        return None
    scale = float(np.median(view.depth_m[rises])) / (min(view.K[0, 0], view.K[1, 1]) * PIXEL_M)
    rim = _RIM_M / PIXEL_M / scale
    spans = []
    for axis, size in ((1, rises.shape[0]), (0, rises.shape[1])):
        there = np.flatnonzero(rises.any(axis=axis))
        spans.append((max(int(there[0] - rim), 0), min(int(there[-1] + rim) + 1, size)))
    (top, bottom), (left, right) = spans
    area = (bottom - top) * (right - left) * scale**2
    scale *= float(min(1.0, np.sqrt(_MOST_PX / area)))
    height, width = (
        max(int(np.ceil(n * scale / multiple_px)), -(-_LEAST_SIDE_PX // multiple_px)) * multiple_px
        for n in (bottom - top, right - left)
    )
    return Window(top, left, scale), height, width


def rising(view: View, grid: VoxelGrid) -> Bool[np.ndarray, "h w"]:
    """Return the pixels of what rises from the support within the grid's outline, without single ones."""
    height = heights_within(
        kernel_array(view.depth_m, np.float32),
        kernel_array(view.K),
        kernel_array(view.T_world_camera),
        kernel_array([grid.origin[:2], grid.upper[:2]]),
    )
    height -= view.support_z_m
    least = max(_LEAST_M, NOISE * support_roughness(height))
    mask = ((height > least) & (height < _MOST_M)).view(np.uint8)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0)


def support_roughness(height: Float[np.ndarray, "..."]) -> float:
    """Return the standard deviation of what lies flat, by the median; `height` is above the support, metres.

    NaN does not count.
    """
    flat = np.abs(height)
    flat = flat[flat < _SUPPORT_M]
    return 1.48 * float(np.median(flat)) if len(flat) else 0.0


def cut(view: View, window: Window, height: int, width: int) -> Patch:
    """Cut the patch of that size at a window; outside the picture it has no reading and is black."""
    rows, cols = window.source(height, width)
    grid_cols, grid_rows = np.meshgrid(cols, rows)
    nearest = cv2.INTER_NEAREST
    depth = cv2.remap(
        view.depth_m, np.rint(grid_cols), np.rint(grid_rows), nearest, borderMode=cv2.BORDER_CONSTANT
    )
    rgb = view.rgb
    if window.scale < 0.6:  # several pixels for one
        blur, rgb = 0.4 / window.scale, rgb.copy()
        rim = int(3 * blur) + 4
        part = tuple(slice(max(int(at[0]) - rim, 0), int(at[-1]) + rim) for at in (rows, cols))
        rgb[part] = cv2.GaussianBlur(rgb[part], (0, 0), blur)
    rgb = cv2.remap(rgb, grid_cols, grid_rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    points = _points(filled(depth), grid_rows, grid_cols, view)
    return Patch(window, np.asarray(rgb, np.uint8), depth, points)


def channels(patch: Patch) -> Float32[np.ndarray, "c h w"]:
    """Return the network's inputs."""
    out = np.empty((CHANNELS, *patch.depth_m.shape), np.float32)
    ahead, up = patch.points[..., 1], patch.points[..., 2]
    out[0] = np.clip(up, _BELOW_M, _ABOVE_M) / _HEIGHT_UNIT_M
    out[1] = np.clip(
        ahead - np.median(ahead[patch.read]) if patch.read.any() else 0 * ahead, -_AHEAD_M, _AHEAD_M
    )
    out[1] /= _AHEAD_UNIT_M
    out[2:5] = _normals(patch.points)
    out[5] = patch.read
    out[6:9] = np.moveaxis(patch.rgb.astype(np.float32) / 127.5 - 1, -1, 0)
    return out


def filled(depth_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Fill missing readings with a rough guess from their surroundings, ever more widely (push and pull)."""
    levels = [(depth_m, (depth_m > 0).astype(np.float32))]
    while min(levels[-1][0].shape) > 1 and (levels[-1][1] == 0).any():
        value, weight = levels[-1]
        size = (max(value.shape[1] // 2, 1), max(value.shape[0] // 2, 1))
        total = cv2.resize(value * weight, size, interpolation=cv2.INTER_AREA)
        share = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
        mean = np.divide(total, share, out=np.zeros_like(total), where=share > 0)
        levels.append((mean, (share > 0).astype(np.float32)))
    value = levels[-1][0]
    for finer, weight in reversed(levels[:-1]):
        coarse = cv2.resize(value, (finer.shape[1], finer.shape[0]), interpolation=cv2.INTER_LINEAR)
        value = np.where(weight > 0, finer, coarse)
    return value.astype(np.float32)


def heading(T_world_camera: Pose) -> Float[np.ndarray, "3 3"]:
    """Return rows right, ahead and up, horizontal except the last.

    Ahead is where the camera looks, or, if it looks down, where the upper edge of its picture points.
    """
    ahead = T_world_camera[:3, 2] - T_world_camera[:3, 1]
    flat = np.array([ahead[0], ahead[1], 0.0])
    length = float(np.linalg.norm(flat))
    flat = flat / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    return np.stack([np.cross(flat, [0.0, 0.0, 1.0]), flat, [0.0, 0.0, 1.0]])


def _points(
    depth_m: Float32[np.ndarray, "h w"], rows: np.ndarray, cols: np.ndarray, view: View
) -> Float32[np.ndarray, "h w 3"]:
    R = heading(view.T_world_camera)
    turn = R @ view.T_world_camera[:3, :3]
    origin = R @ (view.T_world_camera[:3, 3] - [0, 0, view.support_z_m])
    K = view.K
    x, y = (cols - K[0, 2]) / K[0, 0] * depth_m, (rows - K[1, 2]) / K[1, 1] * depth_m
    points = [turn[i, 0] * x + turn[i, 1] * y + turn[i, 2] * depth_m + origin[i] for i in range(3)]
    return np.stack(points, axis=-1).astype(np.float32)


def _normals(points: Float32[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "3 h w"]:
    """Return unit normals of the smoothed surface, towards the camera."""
    smooth = cv2.GaussianBlur(points, (0, 0), _SMOOTH_PX)
    across = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, ksize=3)
    down = cv2.Sobel(smooth, cv2.CV_32F, 0, 1, ksize=3)
    a, b = np.moveaxis(across, -1, 0), np.moveaxis(down, -1, 0)
    normal = np.stack([b[1] * a[2] - b[2] * a[1], b[2] * a[0] - b[0] * a[2], b[0] * a[1] - b[1] * a[0]])
    return normal / np.maximum(np.linalg.norm(normal, axis=0), 1e-9)

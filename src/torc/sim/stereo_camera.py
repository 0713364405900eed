"""Simulate an active stereo camera: two infrared pictures of a scene under projected dots.

The projector sits midway between the cameras, as in an Intel RealSense D400. Each pixel's brightness is its albedo
under room light and under the dots, both falling off as on a matte surface; dots do not reach the projector's shadow.
Shot and read noise follow, as on a sensor.
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from jaxtyping import Bool, Float32, UInt8
from numba import njit

from torc.errors import InputError
from torc.records import StereoPair


@dataclass(frozen=True)
class StereoRig:
    """An active stereo camera.

    Attributes:
        baseline_m: distance of the cameras; .095 as in a RealSense D455.
        dots: brightness of the dots on a white surface hit squarely at 1 m, as a share of full scale.
        light: brightness of a white surface in the room's light.
        shot_noise, read_noise: standard deviations: of a full-scale pixel's photon noise, and of the read-out; shares
            of full scale.
    """

    baseline_m: float = 0.095
    dots: float = 0.45
    light: float = 0.35
    shot_noise: float = 0.02
    read_noise: float = 0.006

    def __post_init__(self) -> None:
        if not 0.005 <= self.baseline_m <= 1.0:
            raise InputError(f"StereoRig.baseline_m is {self.baseline_m}; it is a length from .005 to 1 m.")
        if min(self.dots, self.light, self.shot_noise, self.read_noise) < 0:
            raise InputError("StereoRig: brightness and noise must not be negative.")


_TANGENT = 1.2
"""The dots reach this far from the projector's axis, as the tangent of the angle."""
_PATTERN_PX, _DOTS = 2048, 26_000
_SHADOW_M = 0.012
"""A surface this far behind the first one that the projector hits is in shadow."""


def stereo_pair(
    rig: StereoRig,
    rgb: tuple[UInt8[np.ndarray, "h w 3"], UInt8[np.ndarray, "h w 3"]],
    depth_m: tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]],
    K: np.ndarray,
    rng: np.random.Generator,
) -> StereoPair:
    """Make the pair from an ideal camera's views at the left and at the right place.

    They are colour, and depth along the optical axis in metres (0: nothing).
    """
    # The projector sees from midway: the left camera lies at -b/2 of it, the right one at +b/2.
    clouds = [_Cloud(d, K, shift * rig.baseline_m) for d, shift in zip(depth_m, (-0.5, 0.5))]
    nearest = _nearest_for_projector(clouds)
    left, right = (
        _picture(rig, color, cloud, nearest, rng) for color, cloud in zip(rgb, clouds, strict=True)
    )
    return StereoPair(left, right, rig.baseline_m)


class _Cloud:
    """A camera's view in the projector's frame: points, and their tangents / _TANGENT (2 without depth)."""

    def __init__(self, depth_m: Float32[np.ndarray, "h w"], K: np.ndarray, shift_m: float) -> None:
        h, w = depth_m.shape
        x = ((np.arange(w) - K[0, 2]) / K[0, 0]).astype(np.float32)
        y = ((np.arange(h) - K[1, 2]) / K[1, 1]).astype(np.float32)[:, None]
        self.points = np.stack([depth_m * x + np.float32(shift_m), depth_m * y, depth_m], axis=-1)
        there = depth_m > 0
        shift = np.divide(np.float32(shift_m), depth_m, out=np.full_like(depth_m, 2), where=there)
        self.across = (x + shift) / np.float32(_TANGENT)
        self.down = np.where(there, y, np.float32(2 * _TANGENT)) / np.float32(_TANGENT)

    def cells(self, px: int) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
        """Return column and row in a picture from the projector, of px * px pixels."""
        half = np.float32(0.5 * px)
        return (self.across + 1) * half, (self.down + 1) * half


def _nearest_for_projector(clouds: list[_Cloud]) -> Float32[np.ndarray, "n n"]:
    """Return depth of what the projector hits first, by direction: from all that either camera sees."""
    px = 320
    nearest = np.full(px * px, np.inf, np.float32)
    for cloud in clouds:
        column, row = cloud.cells(px)
        inside = (column >= 0) & (row >= 0) & (column < px) & (row < px)
        index = row[inside].astype(np.int32) * px + column[inside].astype(np.int32)
        np.minimum.at(nearest, index, cloud.points[..., 2][inside])
    return nearest.reshape(px, px)


def _picture(
    rig: StereoRig,
    rgb: UInt8[np.ndarray, "h w 3"],
    cloud: _Cloud,
    nearest: Float32[np.ndarray, "n n"],
    rng: np.random.Generator,
) -> UInt8[np.ndarray, "h w"]:
    gray = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    column, row = cloud.cells(_PATTERN_PX)
    dots = cv2.remap(_pattern(), column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    distance2 = np.maximum((cloud.points**2).sum(axis=-1), 0.04)
    lit = _lit(cloud, nearest) * _facing(cloud.points) / distance2
    signal = gray * (rig.light + rig.dots * dots * lit)
    noise = rng.standard_normal(gray.shape, np.float32)
    signal += noise * np.sqrt(rig.shot_noise**2 * np.clip(signal, 0, 1) + rig.read_noise**2)
    return (np.clip(signal, 0, 1) * 255 + 0.5).astype(np.uint8)


def _lit(cloud: _Cloud, nearest: Float32[np.ndarray, "n n"]) -> Bool[np.ndarray, "h w"]:
    column, row = cloud.cells(len(nearest))
    first = cv2.remap(
        nearest, np.floor(column), np.floor(row), cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT
    )
    return np.asarray(cloud.points[..., 2] <= first + _SHADOW_M)


@njit(cache=True)
def _facing(cloud: Float32[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "h w"]:
    """Return the cosine of the angle at which light from the projector arrives; normals by central differences."""
    h, w, _ = cloud.shape
    cosine = np.zeros((h, w), np.float32)
    across, down = np.empty(3, np.float32), np.empty(3, np.float32)
    for r in range(h):
        above, below = max(r - 1, 0), min(r + 1, h - 1)
        for c in range(w):
            left, right = max(c - 1, 0), min(c + 1, w - 1)
            for k in range(3):
                across[k] = (cloud[r, right, k] - cloud[r, left, k]) / np.float32(right - left)
                down[k] = (cloud[below, c, k] - cloud[above, c, k]) / np.float32(below - above)
            x = down[1] * across[2] - down[2] * across[1]
            y = down[2] * across[0] - down[0] * across[2]
            z = down[0] * across[1] - down[1] * across[0]
            px, py, pz = cloud[r, c]
            length = np.sqrt(x * x + y * y + z * z) * np.sqrt(px * px + py * py + pz * pz)
            if length > 0:
                cosine[r, c] = abs(x * px + y * py + z * pz) / length
    return cosine


@cache
def _pattern() -> Float32[np.ndarray, "n n"]:
    """Return dots at random places, identical for every camera of this type."""
    rng = np.random.default_rng(455)
    picture = np.zeros((_PATTERN_PX, _PATTERN_PX), np.float32)
    rows, columns = rng.integers(0, _PATTERN_PX, (2, _DOTS))
    picture[rows, columns] = 1
    blurred = cv2.GaussianBlur(picture, (0, 0), 2.2)
    return np.minimum(blurred / np.float32(0.7 * blurred[picture > 0].mean()), 1.5).astype(np.float32)

"""Compute depth from a rectified stereo pair: the stage `--depth sgbm`.

Pixels that a matcher did not find have no reading. Filled-in depth (as by a WLS filter) invents surfaces, which a
collision check would believe.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from torc.errors import InputError
from torc.geometry.pixels import finer
from torc.perception.disparity import depth_of_disparity, pair_of
from torc.records import Observation, StereoPair
from torc.registry.kinds import DepthTraits


@dataclass(frozen=True)
class SgbmConfig:
    """Semi-global block matching by OpenCV.

    Attributes:
        block_px: side of the compared blocks, odd.
        smooth_1, smooth_2: price of a disparity that changes by one pixel, and by more; times block_px squared.
        unique_percent: the best match must be better than any other by this.
        speckle_px, speckle_range: patches smaller than this whose disparity differs by more from their surroundings are
            dropped; for pictures of 640 x 480, and more for larger ones.
        full: search paths in eight directions (twice the time) instead of three.
        min_depth_m, max_depth_m: there is no reading nearer or further than this. A nearer limit takes longer.
    """

    block_px: int = 5
    smooth_1: int = 8
    smooth_2: int = 32
    unique_percent: int = 10
    speckle_px: int = 100
    speckle_range: int = 2
    full: bool = False
    min_depth_m: float = 0.3
    max_depth_m: float = 3.0

    def __post_init__(self) -> None:
        if self.block_px < 1 or self.block_px % 2 == 0:
            raise InputError(f"SgbmConfig.block_px is {self.block_px}; it must be odd.")
        if not 0 < self.min_depth_m < self.max_depth_m:
            raise InputError(f"Depth range {self.min_depth_m}..{self.max_depth_m} m is not a range above 0.")


class SgbmMatcher:
    """OpenCV's StereoSGBM, with the left margin kept: the pictures are widened by the largest disparity."""

    def __init__(self, disparities: int, config: SgbmConfig | None = None) -> None:
        """Search disparities of 1 to this many pixels, rounded up to a multiple of 16."""
        c = SgbmConfig() if config is None else config
        self._disparities = -(-disparities // 16) * 16
        area = c.block_px**2
        self._sgbm = cv2.StereoSGBM.create(
            minDisparity=0,
            numDisparities=self._disparities,
            blockSize=c.block_px,
            P1=c.smooth_1 * area,
            P2=c.smooth_2 * area,
            disp12MaxDiff=1,
            preFilterCap=31,
            uniquenessRatio=c.unique_percent,
            speckleWindowSize=c.speckle_px,
            speckleRange=c.speckle_range,
            mode=cv2.StereoSGBM_MODE_HH if c.full else cv2.StereoSGBM_MODE_SGBM_3WAY,
        )

    def match(
        self, left: UInt8[np.ndarray, "h w"], right: UInt8[np.ndarray, "h w"]
    ) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
        """Return disparity, pixels (0 where none was found), and confidence (1 where there is a disparity)."""
        n = self._disparities
        wide = [cv2.copyMakeBorder(p, 0, 0, n, 0, cv2.BORDER_REPLICATE) for p in (left, right)]
        found = self._sgbm.compute(*wide)[:, n:].astype(np.float32) / 16
        # A point that the right picture cannot show, left of its margin, has no match.
        found[(found <= 0) | (found > np.arange(left.shape[1]))] = 0
        return found, (found > 0).astype(np.float32)


class SgbmDepth(DepthTraits):
    """The stage `--depth sgbm`: depth from the camera's two pictures by semi-global block matching."""

    needs_pair = True
    rough = True

    def __init__(self, config: SgbmConfig | None = None) -> None:
        self.config = SgbmConfig() if config is None else config

    def measure(self, observation: Observation) -> Observation:
        """Return the observation with depth from its pair. Raises InputError if it has none."""
        pair = pair_of(observation, "sgbm")
        return replace(observation, depth_m=sgbm_depth(pair, float(observation.K[0, 0]), self.config))


def sgbm_depth(pair: StereoPair, fx: float, config: SgbmConfig) -> Float32[np.ndarray, "h w"]:
    """Return depth of the left picture along its optical axis, metres; 0 for no reading."""
    disparities = int(np.ceil(fx * pair.baseline_m / config.min_depth_m))
    s = finer(pair.left.shape)
    config = replace(
        config, speckle_px=round(s * s * config.speckle_px), speckle_range=round(s * config.speckle_range)
    )
    disparity, _ = SgbmMatcher(disparities, config).match(pair.left, pair.right)
    depth = depth_of_disparity(disparity, fx, pair.baseline_m)
    good = (depth >= config.min_depth_m) & (depth <= config.max_depth_m)
    return np.where(good, depth, np.float32(0))


def made_up_pair(depth_m: Float32[np.ndarray, "h w"], fx: float, baseline_m: float = 0.095) -> StereoPair:
    """Make two pictures of random dots that show a depth, for rehearsals and tests.

    The right picture has other dots where the left camera does not see.
    """
    h, w = depth_m.shape
    rng = np.random.default_rng(0)
    left, hidden = (cv2.GaussianBlur(rng.integers(0, 256, (h, w), np.uint8), (0, 0), 0.8) for _ in range(2))
    disparity = np.divide(np.float32(fx * baseline_m), depth_m, out=np.zeros_like(depth_m), where=depth_m > 0)
    columns, rows = np.meshgrid(np.arange(w, dtype=np.float32), np.arange(h, dtype=np.float32))
    shown = np.rint(columns - disparity).astype(int)
    inside = (shown >= 0) & (disparity > 0)
    in_right = np.zeros_like(disparity)
    np.maximum.at(in_right, (rows[inside].astype(int), shown[inside]), disparity[inside])
    moved = cv2.remap(left, columns + in_right, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return StereoPair(left, np.where(in_right > 0, moved, hidden), baseline_m)

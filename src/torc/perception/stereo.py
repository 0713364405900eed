"""Compute depth from a rectified stereo pair: the stage `--depth sgbm`, and what learned matchers need.

Pixels that a matcher did not find have no reading. Filled-in depth (as by a WLS filter) invents surfaces, which a
collision check would believe.

Learned matchers may take pictures of other sizes than the camera's. A disparity belongs to the width of its picture: on
pictures scaled by s it is s times as many pixels, while fx and baseline stay those of the camera.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from torc.errors import InputError
from torc.geometry.transforms import finer
from torc.records import Observation, StereoPair
from torc.registry.kinds import DepthTraits

_LEAST_SHARE = 1 / 16


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
    return depth_of_disparity(disparity, fx, pair.baseline_m, (config.min_depth_m, config.max_depth_m))


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


@dataclass(frozen=True)
class LearnedStereoConfig:
    """The input to a learned matcher, and which part of its answer is used.

    Attributes:
        scale: the pictures are scaled by this before they are matched: below 1 for speed and for near things.
        min_confidence: readings with a lower confidence (0 to 1) are dropped, if the matcher reports one.
        min_depth_m, max_depth_m: there is no reading nearer or further than this.
    """

    scale: float = 1.0
    min_confidence: float = 0.0
    min_depth_m: float = 0.3
    max_depth_m: float = 3.0

    def __post_init__(self) -> None:
        if not 0.1 <= self.scale <= 4:
            raise InputError(f"A matcher's scale is {self.scale}; it must be from .1 to 4.")
        if not 0 < self.min_depth_m < self.max_depth_m:
            raise InputError(f"Depth range {self.min_depth_m}..{self.max_depth_m} m is not a range above 0.")

    def most_px(self, pair: StereoPair, fx: float) -> int:
        """Return the largest disparity that counts, on the scaled pictures."""
        return int(np.ceil(self.scale * fx * pair.baseline_m / self.min_depth_m))


def pair_of(observation: Observation, stage: str) -> StereoPair:
    """Return the two pictures. Raises InputError if there are none."""
    if observation.pair is None:
        raise InputError(
            f"--depth {stage} needs the two pictures of a stereo camera, and this snapshot has none. Use a stereo "
            "camera, or --depth as-measured for the depth that the camera gives."
        )
    return observation.pair


def scaled(picture: UInt8[np.ndarray, "h w"], scale: float) -> UInt8[np.ndarray, "a b"]:
    """Scale a picture."""
    if scale == 1:
        return picture
    size = [max(1, round(scale * n)) for n in picture.shape[::-1]]
    how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(picture, size, interpolation=how), np.uint8)


def is_scaled(shape: tuple[int, ...], original: tuple[int, ...]) -> bool:
    """Check whether images of these sizes (rows, columns) can be one image at two scales, to within whole pixels."""
    (h, w), (rows, cols) = shape, original
    share = w / cols
    return share >= _LEAST_SHARE and abs(h - share * rows) <= 1


def full_size(image: Float32[np.ndarray, "h w"], shape: tuple[int, ...]) -> Float32[np.ndarray, "rows cols"]:
    """Resize an image by the nearest pixel: values between two surfaces would be on neither."""
    if image.shape == shape:
        return image
    return np.asarray(cv2.resize(image, shape[::-1], interpolation=cv2.INTER_NEAREST_EXACT), np.float32)


def depth_of_disparity(
    disparity_px: Float32[np.ndarray, "h w"],
    fx: float,
    baseline_m: float,
    range_m: tuple[float, float] = (0, np.inf),
) -> Float32[np.ndarray, "h w"]:
    """Return depth along the optical axis, metres; 0 where there is no disparity, or the depth is out of range."""
    with np.errstate(divide="ignore"):
        depth = np.float32(fx * baseline_m) / disparity_px
    good = (disparity_px > 0) & (depth >= range_m[0]) & (depth <= range_m[1])
    return np.where(good, depth, np.float32(0))


def with_disparity(
    observation: Observation,
    disparity_px: Float32[np.ndarray, "h w"],
    confidence: Float32[np.ndarray, "h w"] | None,
    baseline_m: float,
    config: LearnedStereoConfig,
) -> Observation:
    """Return the observation with depth from a disparity.

    The disparity is in its own pixels, of any size that `is_scaled` of the observation's; so is the confidence, 0 to 1.
    There is no reading where the disparity is missing, not trusted, out of range, or leads left of the
    right picture's margin.
    """
    shape = observation.depth_m.shape
    with np.errstate(invalid="ignore", over="ignore"):
        disparity = full_size(disparity_px, shape) * np.float32(shape[1] / disparity_px.shape[1])
        good = np.isfinite(disparity) & (disparity > 0) & (disparity <= np.arange(shape[1]))
        if confidence is not None:
            good &= full_size(confidence, shape) >= config.min_confidence
    found, range_m = np.where(good, disparity, np.float32(0)), (config.min_depth_m, config.max_depth_m)
    depth_m = depth_of_disparity(found, float(observation.K[0, 0]), baseline_m, range_m)
    return replace(observation, depth_m=depth_m)

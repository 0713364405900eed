"""Turn a learned matcher's disparity into depth: sizes, confidence, and points that only one camera sees.

Matchers may take pictures of other sizes than the camera's. A disparity belongs to the width of its picture: on
pictures scaled by s it is s times as many pixels, while fx and baseline stay those of the camera.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from torc.errors import InputError
from torc.records import Observation, StereoPair

_LEAST_SHARE = 1 / 16


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
    disparity_px: Float32[np.ndarray, "h w"], fx: float, baseline_m: float
) -> Float32[np.ndarray, "h w"]:
    """Return depth along the optical axis, metres; 0 where there is no disparity."""
    with np.errstate(divide="ignore"):
        depth = np.float32(fx * baseline_m) / disparity_px
    return np.where(disparity_px > 0, depth, np.float32(0))


def with_disparity(
    observation: Observation,
    disparity_px: Float32[np.ndarray, "h w"],
    confidence: Float32[np.ndarray, "h w"] | None,
    baseline_m: float,
    config: LearnedStereoConfig,
) -> Observation:
    """Return the observation with depth from a disparity.

    There is no reading where the disparity is missing, not trusted, out of range, or leads left of the right picture's
    margin.

    Args:
        observation: of the left camera.
        disparity_px: of any size that `is_scaled` of the observation's, in its own pixels.
        confidence: 0 to 1, of the disparity's size; None if the matcher reports none.
        baseline_m: distance of the two cameras.
        config: limits of depth and confidence.
    """
    shape = observation.depth_m.shape
    with np.errstate(invalid="ignore", over="ignore"):
        disparity = full_size(disparity_px, shape) * np.float32(shape[1] / disparity_px.shape[1])
        good = np.isfinite(disparity) & (disparity > 0) & (disparity <= np.arange(shape[1]))
        if confidence is not None:
            good &= full_size(confidence, shape) >= config.min_confidence
    depth = depth_of_disparity(
        np.where(good, disparity, np.float32(0)), float(observation.K[0, 0]), baseline_m
    )
    good &= (depth >= config.min_depth_m) & (depth <= config.max_depth_m)
    return replace(observation, depth_m=np.where(good, depth, np.float32(0)))

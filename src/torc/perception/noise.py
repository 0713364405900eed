"""Add to a clean observation what a real depth camera and a real segmentation do."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Int16

from torc.errors import InputError
from torc.records import BACKGROUND, Capture


@dataclass(frozen=True)
class NoiseConfig:
    """Strengths, all zero, hence off, by default. `stereo_camera()` gives plausible ones.

    Attributes:
        depth_sigma_m: standard deviation of depth at 1 m; it grows with the distance squared, as stereo's does.
        grain_px: noise is correlated over about this many pixels; 0 or 1 for independent pixels.
        edge_loss: share of the pixels next to a depth jump that lose their reading.
        edge_blend: share of them that get a depth between both surfaces ("flying" points).
        dropout: share of all readings that are lost.
        mask_erosion_px: masks shrink by this much; the rim becomes background.
    """

    depth_sigma_m: float = 0.0
    grain_px: int = 0
    edge_loss: float = 0.0
    edge_blend: float = 0.0
    dropout: float = 0.0
    mask_erosion_px: int = 0

    def __post_init__(self) -> None:
        shares = ("edge_loss", "edge_blend", "dropout")
        if any(not 0 <= getattr(self, name) <= 1 for name in shares):
            raise InputError(f"{', '.join(shares)} are shares from 0 to 1.")
        if min(self.depth_sigma_m, self.grain_px, self.mask_erosion_px) < 0:
            raise InputError("depth_sigma_m, grain_px and mask_erosion_px must not be negative.")


def stereo_camera() -> NoiseConfig:
    """Return roughly the noise of learned stereo on a table-top scene: 2 mm at 1 m, edges smeared, few holes."""
    return NoiseConfig(0.002, grain_px=3, edge_loss=0.3, edge_blend=0.3, dropout=0.002, mask_erosion_px=1)


def add_sensor_noise(capture: Capture, config: NoiseConfig, rng: np.random.Generator) -> Capture:
    """Return a noisy copy of a capture; pixels without a reading stay so. Equal generators give equal noise."""
    observation = capture.observation
    depth = observation.depth_m.astype(np.float32)
    valid = np.isfinite(depth) & (depth > 0)
    clean = np.where(valid, depth, np.float32(0))
    noisy = _blend_edges(clean, valid, config, rng)
    if config.depth_sigma_m > 0:
        noisy = noisy + config.depth_sigma_m * noisy**2 * _grain(noisy.shape, config.grain_px, rng)
    noisy = np.maximum(noisy, np.float32(0))
    if config.dropout > 0:
        noisy[rng.random(noisy.shape) < config.dropout] = 0
    label = capture.label_image
    if label is not None and config.mask_erosion_px > 0:
        label = _erode_masks(label, config.mask_erosion_px)
    observation = replace(observation, depth_m=np.where(valid, noisy, depth).astype(np.float32))
    return Capture(observation, label)


def _blend_edges(
    depth: Float32[np.ndarray, "h w"],
    valid: Bool[np.ndarray, "h w"],
    config: NoiseConfig,
    rng: np.random.Generator,
) -> Float32[np.ndarray, "h w"]:
    """Lose some of the pixels at jumps, or blend their depth between both surfaces."""
    if config.edge_loss == 0 and config.edge_blend == 0:
        return depth.copy()
    kernel = np.ones((3, 3), dtype=np.uint8)
    far = cv2.dilate(depth, kernel)
    near = cv2.erode(np.where(valid, depth, np.float32(1e6)), kernel)
    # 5 % of the distance: more than any surface of a table-top scene falls away within two pixels.
    edge = valid & (far - near > 0.05 * depth)
    out = depth.copy()
    blended = edge & (rng.random(depth.shape) < config.edge_blend)
    share = rng.random(depth.shape).astype(np.float32)
    out[blended] = (near + share * (far - near))[blended]
    out[edge & (rng.random(depth.shape) < config.edge_loss)] = 0
    return out


def _grain(shape: tuple[int, ...], grain_px: int, rng: np.random.Generator) -> Float32[np.ndarray, "h w"]:
    """Draw normal noise of unit variance, smooth over grain_px pixels."""
    noise = rng.standard_normal(shape).astype(np.float32)
    if grain_px <= 1:
        return noise
    kernel = cv2.getGaussianKernel(2 * grain_px + 1, 0.5 * grain_px)
    kernel = kernel / np.linalg.norm(kernel)
    return cv2.sepFilter2D(noise, -1, kernel, kernel).astype(np.float32)


def _erode_masks(label: Int16[np.ndarray, "h w"], px: int) -> Int16[np.ndarray, "h w"]:
    """Turn object pixels within px of another label into background."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * px + 1, 2 * px + 1))
    rim = (cv2.erode(label, kernel) != label) | (cv2.dilate(label, kernel) != label)
    return np.where(rim & (label >= 0), np.int16(BACKGROUND), label).astype(np.int16)

"""The stage `--depth tof`, for simulated cameras: turn exact depth into that of a time-of-flight camera.

Light is modulated, and each pixel measures the phase of what comes back. That is a sum of phasors: of the surface that
it sees, of its neighbours within the lens's blur, and of light scattered in the lens from everywhere. So pixels at an
edge show something between both surfaces ("flying" ones), and near bright things pull far dark ones towards them. The
noise of the phase goes with one over the amplitude: dark, slanted and distant surfaces are rough, and beyond a limit
there is no reading (Foix, Alenya and Torras 2011 review these errors).
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Complex, Float32

from torc.errors import InputError
from torc.records import Observation
from torc.registry.kinds import DepthTraits

_LIGHT_SPEED = 299_792_458.0
_SCATTER_SHARE = 0.12
"""Width of the scattered light, as a share of the picture's width."""


@dataclass(frozen=True)
class TofConfig:
    """A time-of-flight camera.

    Attributes:
        frequency_hz: of the modulation; distances are known up to c / 2f, which several frequencies resolve.
        blur_px: standard deviation of the lens's blur.
        scatter: share of the light that the lens scatters.
        noise_m: standard deviation for a white surface seen squarely at 1 m.
        least: amplitude, relative to that surface's, below which there is no reading.
        seed: of the noise, together with the snapshot's time.
    """

    frequency_hz: float = 60e6
    blur_px: float = 0.7
    scatter: float = 0.01
    noise_m: float = 0.0015
    least: float = 0.04
    seed: int = 0

    def __post_init__(self) -> None:
        if not 1e6 <= self.frequency_hz <= 1e9:
            raise InputError(f"TofConfig.frequency_hz is {self.frequency_hz:g}; it is from 1e6 to 1e9.")
        if min(self.blur_px, self.scatter, self.noise_m, self.least) < 0:
            raise InputError("TofConfig: blur_px, scatter, noise_m and least must not be negative.")


class TofDepth(DepthTraits):
    """Depth with the errors of a time-of-flight camera."""

    rough = True
    simulated_only = True

    def __init__(self, config: TofConfig | None = None) -> None:
        self.config = TofConfig() if config is None else config

    def measure(self, observation: Observation) -> Observation:
        """Return the observation with this camera's depth; equal snapshots give equal depth."""
        rng = np.random.default_rng([self.config.seed, round(1e6 * observation.stamp_s)])
        return replace(observation, depth_m=tof_depth(observation, self.config, rng))


def tof_depth(
    observation: Observation, config: TofConfig, rng: np.random.Generator
) -> Float32[np.ndarray, "h w"]:
    """Return depth along the optical axis, metres; 0 for no reading."""
    exact, stretch = np.nan_to_num(observation.depth_m), _stretch(observation)
    range_m = exact * stretch
    amplitude = _amplitude(observation, range_m)
    per_metre = np.float32(4 * np.pi * config.frequency_hz / _LIGHT_SPEED)
    sent = (amplitude * np.exp(1j * per_metre * range_m)).astype(np.complex64)
    got = _blurred(sent, config.blur_px)
    if config.scatter > 0:
        wide = _blurred(sent, _SCATTER_SHARE * exact.shape[1])
        got = (1 - config.scatter) * got + config.scatter * wide
    strength = np.abs(got)
    # The turns that the phase has lost come from other frequencies; here from the exact range.
    shift = np.angle(got * np.exp(-1j * per_metre * range_m)) / per_metre
    noise = config.noise_m / np.maximum(strength, 1e-6) * rng.standard_normal(exact.shape)
    depth = (range_m + shift + noise) / stretch
    return np.where((exact > 0) & (strength >= config.least), depth, 0).astype(np.float32)


def _stretch(observation: Observation) -> Float32[np.ndarray, "h w"]:
    """Return range along the ray divided by depth along the axis."""
    height, width = observation.depth_m.shape
    K = observation.K
    x = (np.arange(width) - K[0, 2]) / K[0, 0]
    y = (np.arange(height) - K[1, 2]) / K[1, 1]
    return np.sqrt(1 + x**2 + y[:, None] ** 2).astype(np.float32)


def _amplitude(observation: Observation, range_m: Float32[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Return each pixel's brightness in the camera's light, relative to a white surface seen squarely at 1 m."""
    albedo = cv2.cvtColor(observation.rgb, cv2.COLOR_RGB2GRAY).astype(np.float32) / 255
    slope = np.hypot(*np.gradient(range_m)) / np.maximum(range_m, 1e-3) * np.float32(observation.K[0, 0])
    facing = 1 / np.sqrt(1 + np.minimum(slope, 20.0) ** 2)
    return ((0.1 + 0.9 * albedo) * facing / np.maximum(range_m, 0.1) ** 2 * (range_m > 0)).astype(np.float32)


def _blurred(light: Complex[np.ndarray, "h w"], sigma_px: float) -> Complex[np.ndarray, "h w"]:
    if sigma_px <= 0:
        return light
    real, imaginary = (
        cv2.GaussianBlur(np.ascontiguousarray(p), (0, 0), sigma_px) for p in (light.real, light.imag)
    )
    return real + 1j * imaginary

"""What the surroundings of a scene look like: wood, a floor, the sky."""

from functools import cache

import numpy as np


@cache
def wood_texture(size: int = 256) -> np.ndarray:
    """Planks with a grain, always the same: (size, size, 3) uint8, read-only."""
    rng = np.random.default_rng(7)
    v, u = np.meshgrid(np.arange(size) / size, np.arange(size) / size, indexing="ij")
    plank = np.floor(v * 6).astype(int)
    tone, phase = rng.uniform(-0.06, 0.06, 6)[plank], rng.uniform(0, 9, 6)[plank]
    wave = 0.9 * np.sin(2 * np.pi * u + phase) + 0.5 * np.sin(4 * np.pi * u + 2 * phase)
    grain = 0.5 + 0.5 * np.sin(2 * np.pi * (v * 38 + 0.35 * wave) + 3 * phase)
    seam = np.where((v * 6) % 1 < 0.03, 0.75, 1.0)
    light = (0.93 + tone + 0.07 * grain) * seam + 0.012 * rng.standard_normal((size, size))
    color = light[..., None] * np.array([0.80, 0.66, 0.48])
    texture = np.asarray(np.clip(color, 0, 1) * 255, dtype=np.uint8)
    texture.flags.writeable = False
    return texture


def checker_texture(
    a: tuple[float, float, float], b: tuple[float, float, float], size: int = 64
) -> np.ndarray:
    """Two by two squares of two colours: (size, size, 3) uint8."""
    i, j = np.indices((size, size)) // (size // 2)
    return np.asarray(np.where(((i + j) % 2)[..., None], a, b) * np.float64(255), dtype=np.uint8)


def sky_texture(
    low: tuple[float, float, float], high: tuple[float, float, float], size: int = 32
) -> np.ndarray:
    """Six faces of a sky box, stacked: sides shade upwards."""
    t = np.linspace(1, 0, size)[:, None, None]
    side = np.broadcast_to(t * np.array(high) + (1 - t) * np.array(low), (size, size, 3))
    faces = [side, side, np.broadcast_to(high, side.shape), np.broadcast_to(low, side.shape), side, side]
    return np.asarray(np.concatenate(faces) * 255, dtype=np.uint8)

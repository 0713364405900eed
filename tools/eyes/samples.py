"""Training samples: a square of a view, with other depth errors, colours and scale each time."""

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Int16, UInt8

from tools.eyes.collect import BACKGROUND, SavedView, count_views
from torc.geometry.transforms import rotation_about
from torc.perception.embedded.inputs import PIXEL_M, View, Window, channels, cut
from torc.perception.noise import NoiseConfig, add_sensor_noise
from torc.records import Capture, Observation

SQUARE_PX = 224


@dataclass(frozen=True)
class Sample:
    """What the network is given, and the object per pixel, -1 for none."""

    inputs: Float32[np.ndarray, "c h w"]
    label: Int16[np.ndarray, "h w"]


@dataclass(frozen=True)
class SampleConfig:
    """How samples vary.

    Attributes:
        stereo, noisy: shares with depth from the stereo pair, and with made-up sensor noise; the rest is exact.
        scale: smallest and largest, against PIXEL_M.
        colorless, gray: shares without colour at all, and in gray.
        support_sigma_m, tilt_sigma_rad: errors of the support's height, and of what is taken for vertical.
    """

    stereo: float = 0.4
    noisy: float = 0.25
    scale: tuple[float, float] = (0.72, 1.3)
    colorless: float = 0.08
    gray: float = 0.1
    support_sigma_m: float = 0.002
    tilt_sigma_rad: float = 0.012


def index_views(files: list[Path]) -> list[tuple[Path, int]]:
    """All views of some scenes' files."""
    return [(path, i) for path in files for i in range(count_views(path))]


def draw_sample(saved: SavedView, rng: np.random.Generator, config: SampleConfig) -> Sample:
    """A random square of a view."""
    if rng.random() < 0.5:
        saved = mirrored(saved)
    view = _measured(saved, rng, config)
    rows, cols = np.nonzero(saved.label != BACKGROUND)
    at = int(rng.integers(len(rows)))
    z = float(np.median(saved.depth_m[rows, cols]))
    scale = z / (saved.K[0, 0] * PIXEL_M) * float(np.exp(rng.uniform(*np.log(config.scale))))
    offset = rng.uniform(0.2, 0.8, 2) * SQUARE_PX / scale
    window = Window(int(rows[at] - offset[0]), int(cols[at] - offset[1]), scale)
    patch = cut(replace(view, rgb=_recolored(view.rgb, rng, config)), window, SQUARE_PX, SQUARE_PX)
    inputs = channels(patch)
    if rng.random() < config.colorless:
        inputs[6:9] = 0
    return Sample(inputs, cut_label(saved.label, window, SQUARE_PX, SQUARE_PX))


def cut_label(
    label: UInt8[np.ndarray, "h w"], window: Window, height: int, width: int
) -> Int16[np.ndarray, "h w"]:
    """The labels of a patch, -1 for the background and outside of the picture."""
    cols, rows = np.meshgrid(*reversed(window.source(height, width)))
    found = cv2.remap(
        label,
        np.rint(cols),
        np.rint(rows),
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=BACKGROUND,
    ).astype(np.int16)
    return np.where(found == BACKGROUND, np.int16(-1), found)


def mirrored(saved: SavedView) -> SavedView:
    """As seen in a mirror: right is left."""
    K = saved.K.copy()
    K[0, 2] = saved.label.shape[1] - 1 - K[0, 2]
    rgb, depth_m, stereo_m, label = (
        np.ascontiguousarray(image[:, ::-1])
        for image in (saved.rgb, saved.depth_m, saved.stereo_m, saved.label)
    )
    return SavedView(rgb, depth_m, stereo_m, label, K, saved.T_world_camera, saved.support_z_m)


def _measured(saved: SavedView, rng: np.random.Generator, config: SampleConfig) -> View:
    """The view with one of its depths, and what is known of its place with small errors."""
    kind = rng.random()
    depth = saved.stereo_m if kind < config.stereo else saved.depth_m
    if config.stereo <= kind < config.stereo + config.noisy:
        depth = _noisy(saved, rng)
    if rng.random() < 0.3:
        depth = np.where(_blots(depth.shape, rng), np.float32(0), depth)
    T = saved.T_world_camera.copy()
    axis = rng.standard_normal(3)
    T[:3, :3] = rotation_about(axis, float(rng.normal(0, config.tilt_sigma_rad))) @ T[:3, :3]
    # The place of the scene stays; it is the vertical that is wrong.
    rows, cols = np.nonzero(saved.label != BACKGROUND)
    z = float(np.median(saved.depth_m[rows, cols]))
    ray = np.array(
        [(cols.mean() - saved.K[0, 2]) / saved.K[0, 0], (rows.mean() - saved.K[1, 2]) / saved.K[1, 1], 1]
    )
    T[:3, 3] += (saved.T_world_camera[:3, :3] - T[:3, :3]) @ (z * ray)
    support = saved.support_z_m + float(rng.normal(0, config.support_sigma_m))
    return View(saved.rgb, depth, saved.K, T, support)


def _noisy(saved: SavedView, rng: np.random.Generator) -> Float32[np.ndarray, "h w"]:
    noise = NoiseConfig(
        depth_sigma_m=float(rng.uniform(0.0005, 0.005)),
        grain_px=int(rng.integers(1, 7)),
        edge_loss=float(rng.uniform(0, 0.7)),
        edge_blend=float(rng.uniform(0, 0.7)),
        dropout=float(rng.uniform(0, 0.03)),
    )
    observation = Observation(saved.rgb, saved.depth_m, saved.K, saved.T_world_camera, np.zeros(0), 0.0)
    depth = add_sensor_noise(Capture(observation), noise, rng).observation.depth_m
    if rng.random() < 0.3:
        step = np.float32(rng.uniform(0.001, 0.004))  # coarse units
        depth = np.round(depth / step) * step
    return depth.astype(np.float32)


def _blots(shape: tuple[int, ...], rng: np.random.Generator) -> Bool[np.ndarray, "h w"]:
    """Patches without a reading, as shine and dark surfaces leave them."""
    coarse = rng.standard_normal((max(shape[0] // 12, 2), max(shape[1] // 12, 2))).astype(np.float32)
    smooth = cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(smooth > rng.uniform(1.3, 2.2))


def _recolored(rgb: UInt8[np.ndarray, "h w 3"], rng: np.random.Generator, config: SampleConfig) -> np.ndarray:
    picture = rgb.astype(np.float32) / 255
    if rng.random() < 0.5:
        picture = picture[..., rng.permutation(3)]
    if rng.random() < config.gray:
        picture = np.repeat(picture.mean(axis=-1, keepdims=True), 3, axis=-1)
    picture = picture * rng.uniform(0.8, 1.2, 3).astype(np.float32)
    picture = np.clip((picture - 0.5) * rng.uniform(0.6, 1.3) + 0.5 + rng.uniform(-0.15, 0.15), 0, 1)
    picture = picture ** rng.uniform(0.6, 1.6)
    if rng.random() < 0.4:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(0.4, 1.5))))
    picture = picture + rng.uniform(0, 0.04) * rng.standard_normal(picture.shape).astype(np.float32)
    return np.asarray(np.clip(picture, 0, 1) * 255, np.uint8)

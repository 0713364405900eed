"""How a scene is looked at for training: cameras from anywhere, other colours, textures and lights each time.

Simulated colours look like no real ones, so that what is learned must not hang on them: they change from scene to
scene, the light from view to view.
"""

from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from jaxtyping import Float, UInt8

from torc.geometry.transforms import look_at, rotation_about
from torc.sim.stereo_camera import StereoRig
from torc.workspace.description import CameraMount, Workspace

WIDTH, HEIGHT = 640, 480


@dataclass(frozen=True)
class LookConfig:
    """Where cameras stand, and how much of what they see is made up.

    Attributes:
        own_share: share of the views from about the workspace's own camera; the others are from anywhere around.
        distance_m, elevation_rad, vertical_fov_rad: of the others, lowest and highest.
        plain: share of the scenes in which nothing is painted anew.
        repainted: share of the objects that are painted anew in the others.
    """

    own_share: float = 0.3
    distance_m: tuple[float, float] = (0.4, 1.2)
    elevation_rad: tuple[float, float] = (0.25, 1.5)
    vertical_fov_rad: tuple[float, float] = (0.6, 1.45)
    plain: float = 0.3
    repainted: float = 0.7


def camera(
    workspace: Workspace, middle: Float[np.ndarray, "3"], rng: np.random.Generator, config: LookConfig
) -> CameraMount:
    """A camera that sees the middle of a scene."""
    if rng.random() < config.own_share:
        own = workspace.camera
        T = own.T_world_camera.copy()
        T[:3, 3] += rng.normal(0, 0.03, 3)
        T[:3, :3] = T[:3, :3] @ _tilt(rng, 0.06)
        return CameraMount(T, WIDTH, HEIGHT, float(own.vertical_fov_rad * rng.uniform(0.85, 1.0)))
    fov = rng.uniform(*config.vertical_fov_rad)
    # A narrow view needs more distance to see the same.
    nearest = max(config.distance_m[0], 0.16 / np.tan(fov / 2))
    distance = rng.uniform(nearest, max(config.distance_m[1], nearest + 0.1))
    elevation, azimuth = rng.uniform(*config.elevation_rad), rng.uniform(-np.pi, np.pi)
    away = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    target = middle + rng.normal(0, 0.03, 3)
    T = look_at(target + distance * away, target)
    T[:3, :3] = T[:3, :3] @ _tilt(rng, 0.08)
    return CameraMount(T, WIDTH, HEIGHT, float(fov))


def rig(rng: np.random.Generator) -> StereoRig:
    """A stereo camera of some make."""
    return StereoRig(
        baseline_m=float(rng.uniform(0.05, 0.12)),
        dots=float(rng.uniform(0.25, 0.7)),
        light=float(rng.uniform(0.15, 0.5)),
        shot_noise=float(rng.uniform(0.01, 0.03)),
        read_noise=float(rng.uniform(0.003, 0.01)),
    )


def repaint(model: mujoco.MjModel, rng: np.random.Generator, config: LookConfig) -> None:
    """Other colours and patterns for the table, the room and some of the objects, in place; before a renderer is made,
    which keeps textures."""
    if rng.random() < config.plain:
        return
    role = int(mujoco.mjtTextureRole.mjTEXROLE_RGB)
    fixed = {model.material(name).id for name in ("wood", "floor", "wall", "bin", "stand")}
    for material in range(model.nmat):
        if rng.random() > (0.8 if material in fixed else config.repainted):
            continue
        texture = int(model.mat_texid[material, role])
        model.mat_specular[material] = rng.uniform(0, 0.6)
        model.mat_shininess[material] = rng.uniform(0, 0.8)
        if texture < 0:
            model.mat_rgba[material, :3] = random_color(rng)
        elif rng.random() < 0.35:
            model.mat_rgba[material, :3] = 0.35 + 0.65 * random_color(rng)  # its own pattern in another light
        else:
            _fill(model, texture, rng)


def relight(model: mujoco.MjModel, rng: np.random.Generator) -> None:
    """Other lamps, in place."""
    tint = rng.uniform(0.8, 1.0, 3)
    model.vis.headlight.ambient[:] = rng.uniform(0.2, 0.55) * tint
    model.vis.headlight.diffuse[:] = rng.uniform(0, 0.25)
    for light in range(model.nlight):
        direction = np.array([rng.normal(0, 0.6), rng.normal(0, 0.6), -1.0])
        model.light_dir[light] = direction / np.linalg.norm(direction)
        model.light_pos[light] = np.array([0.65, -0.12, 1.05]) - 2.0 * model.light_dir[light]
        model.light_diffuse[light] = rng.uniform(0.1, 0.6) * rng.uniform(0.8, 1.0, 3)
        model.light_specular[light] = rng.uniform(0, 0.5)
        model.light_castshadow[light] = rng.random() < 0.6


def _tilt(rng: np.random.Generator, sigma_rad: float) -> Float[np.ndarray, "3 3"]:
    axis = rng.standard_normal(3)
    return rotation_about(axis / np.linalg.norm(axis), float(rng.normal(0, sigma_rad)))


def random_color(rng: np.random.Generator) -> Float[np.ndarray, "3"]:
    """A colour, bright and pale ones as often as dark and strong ones."""
    hue, saturation, value = rng.uniform(0, 180), 255 * rng.random() ** 1.5, 255 * rng.uniform(0.12, 1.0)
    pixel = np.array([[[hue, saturation, value]]], np.uint8)
    return np.asarray(cv2.cvtColor(pixel, cv2.COLOR_HSV2RGB)[0, 0] / 255.0)


def _fill(model: mujoco.MjModel, texture: int, rng: np.random.Generator) -> None:
    """Paints over a texture."""
    height, width = int(model.tex_height[texture]), int(model.tex_width[texture])
    channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
    pixels = model.tex_data[start : start + height * width * channels].reshape(height, width, channels)
    pixels[..., :3] = pattern(height, width, rng)


def pattern(height: int, width: int, rng: np.random.Generator) -> UInt8[np.ndarray, "h w 3"]:
    """A plain colour, stripes, patches, blots or print, in a few colours."""
    colors = np.array([random_color(rng) for _ in range(4)])
    kind = rng.integers(5)
    v, u = np.mgrid[:height, :width] / max(height, width)
    if kind == 0:
        index = np.zeros((height, width), int)
    elif kind == 1:
        angle, count = rng.uniform(0, np.pi), rng.uniform(2, 14)
        index = (np.floor(count * (u * np.cos(angle) + v * np.sin(angle))).astype(int)) % 2
    elif kind == 2:
        index = np.zeros((height, width), int)
        for k in range(int(rng.integers(1, 7))):
            r0, c0 = rng.integers(height), rng.integers(width)
            r1, c1 = r0 + int(rng.uniform(0.05, 0.5) * height), c0 + int(rng.uniform(0.05, 0.5) * width)
            index[r0:r1, c0:c1] = k % 4
    else:
        noise = rng.standard_normal((height, width)).astype(np.float32)
        sigma = float(max(height, width) * rng.uniform(0.005, 0.12))
        noise = np.asarray(cv2.GaussianBlur(noise, (0, 0), sigma), np.float32)
        levels = np.quantile(noise, [0.3, 0.6, 0.85] if kind == 3 else [0.8])
        index = np.searchsorted(levels, noise)
    shade = 1 + 0.03 * rng.standard_normal((height, width, 1))
    return np.asarray(np.clip(colors[index] * shade, 0, 1) * 255, np.uint8)

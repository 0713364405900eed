"""Render without GL: one ray per pixel, simple shading. Slower and plainer, but it runs anywhere."""

import mujoco
import numpy as np
from jaxtyping import Float, Float32, Int32, UInt8

from torc.geometry.transforms import Pose

_VISIBLE_GROUPS = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
_SKY_RGB = np.array([0.72, 0.80, 0.90])
_TO_LIGHT = np.array([-0.35, 0.3, 0.89])
_AMBIENT, _DIFFUSE = 0.55, 0.5


def pixel_directions(K: Float[np.ndarray, "3 3"], width: int, height: int) -> Float[np.ndarray, "n 3"]:
    """Return the direction of every pixel, row by row, OpenCV camera frame, with z = 1: ray length is depth."""
    cols, rows = np.meshgrid(np.arange(width), np.arange(height))
    x, y = (cols - K[0, 2]) / K[0, 0], (rows - K[1, 2]) / K[1, 1]
    return np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3)


def cast(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    T_world_camera: Pose,
    directions: Float[np.ndarray, "n 3"],
    far_m: float,
) -> tuple[Float32[np.ndarray, "n"], Int32[np.ndarray, "n"], Float[np.ndarray, "n 3"]]:
    """Return depth (0 = nothing), geom (-1 = nothing) and world normal that each ray meets among the visible geoms."""
    n = len(directions)
    vectors = directions @ T_world_camera[:3, :3].T
    geoms, depths, normals = np.full(n, -1, np.int32), np.zeros(n), np.zeros(3 * n)
    eye = np.ascontiguousarray(T_world_camera[:3, 3])
    mujoco.mj_multiRay(
        model, data, eye, vectors.ravel(), _VISIBLE_GROUPS, True, -1, geoms, depths, normals, n, far_m
    )
    depths[geoms < 0] = 0.0
    return depths.astype(np.float32), geoms, normals.reshape(-1, 3)


def shade(
    model: mujoco.MjModel, geoms: Int32[np.ndarray, "n"], normals: Float[np.ndarray, "n 3"]
) -> UInt8[np.ndarray, "n 3"]:
    """Return the colour of each ray: the mean colour of its geom, lit by one distant lamp."""
    colors = np.vstack([geom_colors(model), _SKY_RGB])
    light = _AMBIENT + _DIFFUSE * np.clip(normals @ _TO_LIGHT, 0.0, 1.0)
    light[geoms < 0] = 1.0
    return np.asarray(np.clip(colors[geoms] * light[:, None], 0, 1) * 255, dtype=np.uint8)


def geom_colors(model: mujoco.MjModel) -> Float[np.ndarray, "g 3"]:
    """Return the mean colour of every geom, 0..1: its own or its material's, times the mean of its texture."""
    colors = model.geom_rgba[:, :3].astype(float)
    for geom in np.flatnonzero(model.geom_matid >= 0):
        material = model.geom_matid[geom]
        colors[geom] = model.mat_rgba[material, :3]
        texture = model.mat_texid[material, int(mujoco.mjtTextureRole.mjTEXROLE_RGB)]
        if texture >= 0:
            channels, start = model.tex_nchannel[texture], model.tex_adr[texture]
            count = model.tex_height[texture] * model.tex_width[texture] * channels
            pixels = model.tex_data[start : start + count].reshape(-1, channels)
            colors[geom] *= pixels[:, :3].mean(axis=0) / 255.0
    return colors

"""Analytic scenes on the table, ray-cast: exact depth, labels and normals without a physics engine."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import count, product
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, UInt8

from torc.errors import InputError
from torc.geometry.transforms import make_pose, project, rotation_from_wxyz
from torc.records import BACKGROUND, MAX_OBJECTS, Capture, Observation
from torc.sim.raycasting import cast, pixel_directions
from torc.workspace.description import CameraMount
from torc.workspace.workspace_files import load_workspace

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SyntheticBox:
    """A box: full edge lengths, pose in the world frame, id in the label image (BACKGROUND for furniture)."""

    id: int
    center: tuple[float, float, float]
    size: tuple[float, float, float]
    wxyz: tuple[float, float, float, float] = _UPRIGHT


@dataclass(frozen=True)
class SyntheticCylinder:
    """A solid cylinder, its axis along its own z."""

    id: int
    center: tuple[float, float, float]
    radius_m: float
    height_m: float
    wxyz: tuple[float, float, float, float] = _UPRIGHT


@dataclass(frozen=True)
class SyntheticSphere:
    """A ball."""

    id: int
    center: tuple[float, float, float]
    radius_m: float


Shape = SyntheticBox | SyntheticCylinder | SyntheticSphere


@dataclass(frozen=True)
class Raycast:
    """Exact image of a scene: depth along the optical axis, ids of the shapes (BACKGROUND for table, floor, nothing),
    outward normals in the world frame. Depth and normal are 0 where a ray meets nothing.
    """

    depth_m: Float32[np.ndarray, "h w"]
    label_image: Int16[np.ndarray, "h w"]
    normals: Float32[np.ndarray, "h w 3"]


def shape_pose(shape: Shape) -> Float[np.ndarray, "4 4"]:
    """Return the pose of the shape's own frame (origin at its centre)."""
    R = np.eye(3) if isinstance(shape, SyntheticSphere) else rotation_from_wxyz(shape.wxyz)
    return make_pose(R, shape.center)


def half_sizes(shape: Shape) -> tuple[float, float, float]:
    """Return the half extents along the shape's own axes."""
    if isinstance(shape, SyntheticBox):
        x, y, z = shape.size
        return (x / 2, y / 2, z / 2)
    if isinstance(shape, SyntheticCylinder):
        return (shape.radius_m, shape.radius_m, shape.height_m / 2)
    return (shape.radius_m, shape.radius_m, shape.radius_m)


def inside(shape: Shape, points: Float[np.ndarray, "*n 3"], margin_m: float = 0.0) -> Bool[np.ndarray, "*n"]:
    """Return, per world point, whether it lies in the shape, grown by a margin (shrunk if negative)."""
    T = shape_pose(shape)
    p = (points - T[:3, 3]) @ T[:3, :3]
    half = np.asarray(half_sizes(shape)) + margin_m
    if isinstance(shape, SyntheticBox):
        return np.all(np.abs(p) <= half, axis=-1)
    if isinstance(shape, SyntheticCylinder):
        return (np.hypot(p[..., 0], p[..., 1]) <= half[0]) & (np.abs(p[..., 2]) <= half[2])
    return np.linalg.norm(p, axis=-1) <= half[0]


def raycast(
    shapes: Sequence[Shape], mount: CameraMount | None = None, support_z_m: float | None = None
) -> Raycast:
    """Return an image of the shapes on the workspace's table, with its top at `support_z_m` if given.

    A floor at z = 0 and a far wall at x = 6 m give every pixel a reading. Raises InputError for a shape without volume.
    """
    workspace = load_workspace()
    mount = mount or workspace.camera
    if flat := [s for s in shapes if min(half_sizes(s)) <= 0]:
        raise InputError(f"{flat[0]} has no volume; give it positive sizes.")
    view = (mount.T_world_camera.tobytes(), mount.width, mount.height, mount.vertical_fov_rad)
    room = _room(view, workspace.support_z_m if support_z_m is None else support_z_m)
    depth_m, label_image, normals = room.depth_m.copy(), room.label_image.copy(), room.normals.copy()
    near = np.zeros(depth_m.shape, dtype=bool)
    for shape in shapes:
        near[_around(shape, mount)] = True
    if shapes:
        found = _cast(shapes, mount, near.ravel())
        ahead = (found[0] > 0) & ((found[0] < depth_m[near]) | (depth_m[near] == 0))
        at = np.flatnonzero(near)[ahead]
        for image, values in zip((depth_m.ravel(), label_image.ravel(), normals.reshape(-1, 3)), found):
            image[at] = values[ahead]
    return Raycast(depth_m, label_image, normals)


@lru_cache(maxsize=8)
def _room(view: tuple[bytes, int, int, float], support_z_m: float) -> Raycast:
    """Return the image without shapes, cached by what makes a mount."""
    pose, width, height, vertical_fov_rad = view
    mount = CameraMount(np.frombuffer(pose).reshape(4, 4), width, height, vertical_fov_rad)
    (x, y, _), size = load_workspace().table.center, load_workspace().table.size
    floor = SyntheticBox(BACKGROUND, (0, 0, -0.5), (40, 40, 1))
    wall = SyntheticBox(BACKGROUND, (6.5, 0, 0), (1, 40, 40))
    table = SyntheticBox(BACKGROUND, (x, y, support_z_m - size[2] / 2), size)
    depth_m, label_image, normals = _cast((table, floor, wall), mount, np.ones(width * height, dtype=bool))
    shape = (height, width)
    return Raycast(depth_m.reshape(shape), label_image.reshape(shape), normals.reshape(*shape, 3))


def _cast(
    shapes: Sequence[Shape], mount: CameraMount, pixels: Bool[np.ndarray, "n"]
) -> tuple[Float32[np.ndarray, "m"], Int16[np.ndarray, "m"], Float32[np.ndarray, "m 3"]]:
    """Return depth, id and normal at the marked pixels, row by row."""
    world = mujoco.MjSpec()
    for shape in shapes:
        _add_geom(world, shape)
    model = world.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    directions = pixel_directions(mount.K, mount.width, mount.height)[pixels]
    depth_m, hit, normals = cast(model, data, mount.T_world_camera, directions, mujoco.mjMAXVAL)
    ids = np.array([*(s.id for s in shapes), BACKGROUND], dtype=np.int16)
    return depth_m, ids[hit], normals.astype(np.float32)


def _around(shape: Shape, mount: CameraMount) -> tuple[slice, slice]:
    """Return rows and columns of a rectangle around the image of a shape; all if it reaches behind the camera."""
    half = np.array(half_sizes(shape))
    T = shape_pose(shape)
    corners = np.array(list(product(*zip(-half, half)))) @ T[:3, :3].T + T[:3, 3]
    cols, rows, depths = project(corners, mount.K, mount.T_world_camera)
    if depths.min() <= 0:
        return slice(None), slice(None)
    (r0, c0), (r1, c1) = ([int(f(a)) for a in (rows, cols)] for f in (np.min, np.max))
    return slice(max(r0 - 1, 0), max(r1 + 3, 0)), slice(max(c0 - 1, 0), max(c1 + 3, 0))


def synthetic_observation(shapes: Sequence[Shape], mount: CameraMount | None = None) -> Observation:
    """Return the observation of `synthetic_capture`."""
    return synthetic_capture(shapes, mount).observation


def synthetic_capture(
    shapes: Sequence[Shape],
    mount: CameraMount | None = None,
    support_z_m: float | None = None,
    stamp_s: float = 0.0,
) -> Capture:
    """Return what a camera, by default the workspace's, sees of the shapes: exact depth and labels, shaded colours."""
    mount = mount or load_workspace().camera
    image = raycast(shapes, mount, support_z_m)
    observation = Observation(
        rgb=_shade(image, mount.T_world_camera),
        depth_m=image.depth_m,
        K=mount.K,
        T_world_camera=mount.T_world_camera,
        qpos=np.zeros(0),
        stamp_s=stamp_s,
    )
    return Capture(observation, image.label_image)


def random_clutter(rng: np.random.Generator, n: int) -> tuple[Shape, ...]:
    """Return n shapes with ids 0..n-1 standing in the clutter region, some on top of others; none overlap.

    Upright boxes (any yaw), upright cylinders and balls of household size. When the region (x .50-.80, y -.35-.12) is
    full, further shapes are stacked on flat tops, then the region grows.
    """
    z = load_workspace().support_z_m
    shapes: list[Shape] = []
    free_tops: list[Shape] = []
    while len(shapes) < n:
        shape = _random_shape(rng, len(shapes))
        stacked = _stacked(shape, free_tops, shapes, rng) if rng.random() < 0.25 else None
        shape = _placed(shape, shapes, z, rng) if stacked is None else stacked
        shapes.append(shape)
        if not isinstance(shape, SyntheticSphere) and min(half_sizes(shape)[:2]) > 0.025:
            free_tops.append(shape)
    return tuple(shapes)


def _add_geom(world: Any, shape: Shape) -> None:
    half = half_sizes(shape)
    kind, size = {
        SyntheticBox: (mujoco.mjtGeom.mjGEOM_BOX, half),
        SyntheticCylinder: (mujoco.mjtGeom.mjGEOM_CYLINDER, (half[0], half[2], 0.0)),
        SyntheticSphere: (mujoco.mjtGeom.mjGEOM_SPHERE, half),
    }[type(shape)]
    world.worldbody.add_geom(type=kind, size=size, pos=shape.center, quat=getattr(shape, "wxyz", _UPRIGHT))


def _shade(image: Raycast, T_world_camera: Float[np.ndarray, "4 4"]) -> UInt8[np.ndarray, "h w 3"]:
    """Shade (Lambert) under a light at the camera; hue by the golden angle of the id."""
    light = np.abs(image.normals @ (-T_world_camera[:3, 2]))
    hue = (np.arange(MAX_OBJECTS) * 0.381966) % 1.0
    k = np.array([0.0, 2 / 3, 1 / 3])
    colors = 0.55 + 0.35 * np.cos(2 * np.pi * (hue[:, None] + k))
    color = np.vstack([colors, (0.62, 0.58, 0.52)])[np.maximum(image.label_image, -1)]
    color[image.depth_m == 0] = (0.75, 0.8, 0.85)
    light[image.depth_m == 0] = 1.0
    return np.clip(255 * color * (0.35 + 0.65 * light[..., None]), 0, 255).astype(np.uint8)


def _random_shape(rng: np.random.Generator, object_id: int) -> Shape:
    """Draw a shape at the origin."""
    kind = rng.choice(3, p=[0.5, 0.4, 0.1])
    if kind == 0:
        yaw = rng.uniform(-np.pi, np.pi)
        x, y = rng.uniform(0.03, 0.09, 2)
        size = (float(x), float(y), float(rng.uniform(0.03, 0.18)))
        return SyntheticBox(object_id, (0, 0, 0), size, (np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)))
    if kind == 1:
        radius, height = float(rng.uniform(0.02, 0.045)), float(rng.uniform(0.04, 0.18))
        return SyntheticCylinder(object_id, (0, 0, 0), radius, height)
    return SyntheticSphere(object_id, (0, 0, 0), float(rng.uniform(0.025, 0.045)))


def _moved(shape: Shape, x: float, y: float, bottom_z: float) -> Shape:
    """Return the shape with its centre over (x, y) and its bottom at a height."""
    center = (float(x), float(y), float(bottom_z + half_sizes(shape)[2]))
    return replace(shape, center=center)


def _stacked(
    shape: Shape, free_tops: list[Shape], others: Sequence[Shape], rng: np.random.Generator
) -> Shape | None:
    """Put the shape on a flat top (which is then taken); None if it would reach into the base's neighbours."""
    if not free_tops:
        return None
    base = free_tops.pop(int(rng.integers(len(free_tops))))
    x, y, z = base.center
    around = [o for o in others if o.center[:2] != (x, y)]
    return _moved(shape, x, y, z + half_sizes(base)[2]) if _fits(shape, x, y, around) else None


def _placed(shape: Shape, others: Sequence[Shape], support_z_m: float, rng: np.random.Generator) -> Shape:
    """Put the shape on the table at a free place; the region grows a little with every failed draw."""
    for draws in count():
        grow = 0.0005 * max(0, draws - 200)
        x = rng.uniform(0.50 - grow / 4, 0.80 + grow / 2)
        y = rng.uniform(-0.35 - grow, 0.12 + grow)
        if _fits(shape, x, y, others):
            break
    return _moved(shape, x, y, support_z_m)


def _fits(shape: Shape, x: float, y: float, others: Sequence[Shape]) -> bool:
    """True if it meets none of the others there, seen from above."""
    return all(np.hypot(x - o.center[0], y - o.center[1]) > _footprint(shape) + _footprint(o) for o in others)


def _footprint(shape: Shape) -> float:
    """Return the radius of the circle around the shape seen from above."""
    half = half_sizes(shape)
    return float(np.hypot(half[0], half[1])) if isinstance(shape, SyntheticBox) else half[0]

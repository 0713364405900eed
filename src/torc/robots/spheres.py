"""Cover a robot's collision geoms by spheres up to `tolerance_m`; collision checks pad them by more than that."""

from itertools import product

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, invert
from torc.robots.description import ArmDescription, SphereModel
from torc.robots.gripper import GripperDescription
from torc.robots.gripper_parsing import box_in, place_gripper, tcp_pose
from torc.robots.model import Model

KNUCKLE = -2
"""Link mark of bodies between the gripper's body and its fingers."""
Spheres = Float[np.ndarray, "n 4"]
"""x, y, z, radius."""


def cover_geom(kind: str, size: np.ndarray, aabb_half: np.ndarray, tolerance_m: float) -> Spheres:
    """Return spheres of a MuJoCo geom of that size, in its frame; for meshes and ellipsoids: of its bounding box.

    A capsule's are so close that notches are at most tolerance_m deep. A cylinder has one per slab about as high as it
    is wide, and a box one per roughly cubic cell; their rims or corners stick out by at most tolerance_m.
    """
    if kind == "sphere":
        return np.array([[0.0, 0.0, 0.0, size[0]]])
    if kind not in ("capsule", "cylinder"):
        return _cover_box(aabb_half, tolerance_m)
    radius, half_length = size[0], size[1]
    depth = min(tolerance_m, 0.3 * radius)
    if kind == "capsule":
        spacing = 2.0 * np.sqrt(2.0 * radius * depth - depth * depth)
        n = 1 + int(np.ceil(2.0 * half_length / spacing - 1e-9)) if half_length > 0 else 1
        z = np.linspace(-half_length, half_length, n) if n > 1 else np.zeros(1)
    else:
        n = max(1, round(half_length / radius))
        half_slab = half_length / n
        z = (2.0 * np.arange(n) + 1.0) * half_slab - half_length
        radius = np.hypot(radius, half_slab) - depth
    return np.column_stack([np.zeros((n, 2)), z, np.full(n, radius)])


def _cover_box(half_size: np.ndarray, tolerance_m: float) -> Spheres:
    half = np.asarray(half_size, dtype=float)
    counts = np.maximum(1, np.rint(half / half.min())).astype(int)
    cell = half / counts
    axes = [(2.0 * np.arange(n) + 1.0) * c - h for n, c, h in zip(counts, cell, half)]
    centers = np.array(list(product(*axes)))
    radius = np.linalg.norm(cell) - min(tolerance_m, 0.4 * half.min())
    return np.column_stack([centers, np.full(len(centers), radius)])


def parse_spheres(
    model: Model, arm: ArmDescription, gripper: GripperDescription, links: np.ndarray
) -> SphereModel:
    """Return spheres of everything that moves. `links`: per body its link number, -1 static, KNUCKLE."""
    _open(model, gripper, 0.0)
    T_tool0_world = invert(model.site_pose(model.entry.arm.tool0_site))
    frames = [invert(model.joint_pose(model.id("joint", n))) for n in arm.joint_names]
    frames += [T_tool0_world, *[invert(tcp_pose(model))] * 2]
    parts: list[tuple[int, np.ndarray]] = []
    for body, link in enumerate(links.tolist()):
        if link >= 0:
            parts += [(link, s) for s in _body_spheres(model, body, link - arm.dof - 1, frames[link])]
    parts += _knuckle_spheres(model, arm, gripper, links)
    parts.sort(key=lambda part: part[0])
    spheres = np.array([s for _, s in parts])
    of_link = np.array([k for k, _ in parts], dtype=np.int64)
    return SphereModel(of_link, spheres[:, :3].copy(), spheres[:, 3].copy())


def static_spheres(model: Model, links: np.ndarray) -> Float[np.ndarray, "k 4"]:
    """Return spheres of everything that does not move, world frame."""
    model.place({})
    covers = [_geom_spheres(model, g, np.eye(4)) for g in _geoms_of(model, links, -1)]
    return np.concatenate([np.zeros((0, 4)), *covers])


def _geoms_of(model: Model, links: np.ndarray, link: int) -> list[int]:
    return [g for body in np.flatnonzero(links == link).tolist() for g in model.collision_geoms(body)]


def _open(model: Model, gripper: GripperDescription, width_m: float) -> None:
    driver = gripper.joint_names.index(model.entry.gripper.driver_joint)
    place_gripper(model, float(gripper.qpos(width_m)[driver]))


def _geom_spheres(model: Model, geom: int, T_frame_world: Pose) -> Spheres:
    m, tolerance_m = model.m, model.entry.spheres.tolerance_m
    local = cover_geom(model.kind(geom), m.geom_size[geom], m.geom_aabb[geom, 3:], tolerance_m)
    T = T_frame_world @ model.geom_pose(geom)
    return np.column_stack([local[:, :3] @ T[:3, :3].T + T[:3, 3], local[:, 3]])


def _body_spheres(model: Model, body: int, finger: int, T_frame_world: Pose) -> list[np.ndarray]:
    """Return spheres of one body in its link's frame; a finger's pads and blade are covered as one box."""
    geoms, out = model.collision_geoms(body), []
    if finger >= 0:
        parts = model.entry.gripper.fingers[finger]
        blade = [model.id("geom", g) for g in (*parts.pad_geoms, *parts.blade_geoms)]
        geoms = [g for g in geoms if g not in blade]
        center, half = box_in(T_frame_world, np.concatenate([model.box_corners(g) for g in blade]))
        box = _cover_box(half, model.entry.spheres.tolerance_m)
        box[:, :3] += center
        out += list(box)
    for g in geoms:
        out += list(_geom_spheres(model, g, T_frame_world))
    return out


def _knuckle_spheres(
    model: Model, arm: ArmDescription, gripper: GripperDescription, links: np.ndarray
) -> list[tuple[int, np.ndarray]]:
    """Return spheres of the parts that neither rest in the palm nor move with a finger.

    They move with the frame they move least in, enlarged by the remaining travel beyond the tolerance.
    """
    tolerance, geoms = model.entry.spheres.tolerance_m, _geoms_of(model, links, KNUCKLE)
    if not geoms:
        return []
    tracks, widths = [], np.linspace(0.0, gripper.max_width_m, 25)
    for width in widths:
        _open(model, gripper, width)
        frames = invert(model.site_pose(model.entry.arm.tool0_site)), invert(tcp_pose(model))
        world = np.concatenate([_geom_spheres(model, g, np.eye(4)) for g in geoms])
        tracks.append([world[:, :3] @ T[:3, :3].T + T[:3, 3] for T in frames])
    tool0, tcp = (np.array([t[k] for t in tracks]) for k in (0, 1))
    out = []
    for i, radius in enumerate(world[:, 3]):
        side = 0 if tcp[0, i, 0] < 0 else 1
        shift = np.outer(0.5 * widths, [1.0 - 2.0 * side, 0.0, 0.0])
        choices = [(arm.dof, tool0[:, i]), (arm.dof + 1 + side, tcp[:, i] + shift)]
        fits = []
        for link, track in choices:
            center = 0.5 * (track.min(axis=0) + track.max(axis=0))
            fits.append((float(np.linalg.norm(track - center, axis=1).max()), link, center))
        reach, link, center = min(fits, key=lambda fit: fit[0])
        out.append((link, np.append(center, radius + max(0.0, reach - tolerance))))
    return out

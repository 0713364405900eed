"""The sphere models of a robot, from the collision geoms of its MJCF."""

import numpy as np
from jaxtyping import Float

from torc.geometry.transforms import Pose, invert
from torc.robots.description import ArmDescription, SphereModel
from torc.robots.gripper import GripperDescription
from torc.robots.gripper_parsing import place_gripper, tcp_pose
from torc.robots.model import Model
from torc.robots.schema import RobotFile
from torc.robots.spheres import cover_box, cover_geom, enclosing_center

KNUCKLE = -2
"""Link mark of bodies between the gripper's body and its fingers."""


def parse_spheres(
    model: Model, entry: RobotFile, arm: ArmDescription, gripper: GripperDescription, links: np.ndarray
) -> SphereModel:
    """Spheres of all that moves. `links`: per body its link number, -1 static, KNUCKLE."""
    place_gripper(model, entry.gripper, _driver_angle(entry, gripper, 0.0))
    T_tool0_world = invert(model.site_pose(entry.arm.tool0_site))
    frames = [invert(model.joint_pose(model.id("joint", n))) for n in arm.joint_names]
    frames += [T_tool0_world, *[invert(tcp_pose(model, entry.gripper))] * 2]
    parts: list[tuple[int, np.ndarray]] = []
    for body in range(1, model.m.nbody):
        link = int(links[body])
        if link >= 0:
            parts += [(link, s) for s in _body_spheres(model, entry, body, link - arm.dof - 1, frames[link])]
    parts += _knuckle_spheres(model, entry, arm, gripper, links)
    parts.sort(key=lambda part: part[0])
    spheres = np.array([s for _, s in parts])
    return SphereModel(
        np.array([k for k, _ in parts], dtype=np.int64), spheres[:, :3].copy(), spheres[:, 3].copy()
    )


def static_spheres(model: Model, links: np.ndarray, tolerance_m: float) -> Float[np.ndarray, "k 4"]:
    """Spheres of all that does not move, world frame."""
    model.place({})
    bodies = [b for b in range(model.m.nbody) if links[b] == -1]
    parts = [
        _geom_spheres(model, g, np.eye(4), tolerance_m) for b in bodies for g in model.collision_geoms(b)
    ]
    return np.concatenate(parts) if parts else np.zeros((0, 4))


def _driver_angle(entry: RobotFile, gripper: GripperDescription, width_m: float) -> float:
    return float(gripper.qpos(width_m)[gripper.joint_names.index(entry.gripper.driver_joint)])


def _geom_spheres(
    model: Model, geom: int, T_frame_world: Pose, tolerance_m: float
) -> Float[np.ndarray, "n 4"]:
    m = model.m
    local = cover_geom(model.kind(geom), m.geom_size[geom], m.geom_aabb[geom, 3:], tolerance_m)
    T = T_frame_world @ model.geom_pose(geom)
    return np.column_stack([local[:, :3] @ T[:3, :3].T + T[:3, 3], local[:, 3]])


def _body_spheres(
    model: Model, entry: RobotFile, body: int, finger: int, T_frame_world: Pose
) -> list[np.ndarray]:
    """Spheres of one body in its link's frame; a finger's pads and blade are covered as one box."""
    tolerance, geoms, out = entry.spheres.tolerance_m, model.collision_geoms(body), []
    if finger >= 0:
        parts = entry.gripper.fingers[finger]
        blade = [model.id("geom", g) for g in (*parts.pad_geoms, *parts.blade_geoms)]
        geoms = [g for g in geoms if g not in blade]
        corners = np.concatenate([model.box_corners(g) for g in blade])
        corners = corners @ T_frame_world[:3, :3].T + T_frame_world[:3, 3]
        low, high = corners.min(axis=0), corners.max(axis=0)
        box = cover_box(0.5 * (high - low), tolerance)
        box[:, :3] += 0.5 * (low + high)
        out += list(box)
    for g in geoms:
        out += list(_geom_spheres(model, g, T_frame_world, tolerance))
    return out


def _knuckle_spheres(
    model: Model, entry: RobotFile, arm: ArmDescription, gripper: GripperDescription, links: np.ndarray
) -> list[tuple[int, np.ndarray]]:
    """Spheres of the parts that neither rest in the palm nor move with a finger: with the frame they move least in.

    The sphere is enlarged by half the remaining travel beyond the tolerance.
    """
    knuckles = [b for b in range(model.m.nbody) if links[b] == KNUCKLE]
    widths = np.linspace(0.0, gripper.max_width_m, 25)
    if not knuckles:
        return []
    tracks = []
    for width in widths:
        place_gripper(model, entry.gripper, _driver_angle(entry, gripper, width))
        T_tool0_world = invert(model.site_pose(entry.arm.tool0_site))
        T_tcp_world = invert(tcp_pose(model, entry.gripper))
        geoms = [g for b in knuckles for g in model.collision_geoms(b)]
        world = np.concatenate([_geom_spheres(model, g, np.eye(4), entry.spheres.tolerance_m) for g in geoms])
        tracks.append([world[:, :3] @ T[:3, :3].T + T[:3, 3] for T in (T_tool0_world, T_tcp_world)])
    tool0, tcp = (np.array([t[k] for t in tracks]) for k in (0, 1))
    out = []
    for i, radius in enumerate(world[:, 3]):
        side = 0 if tcp[0, i, 0] < 0 else 1
        shift = np.outer(0.5 * widths, [1.0 - 2.0 * side, 0.0, 0.0])
        choices = [(arm.dof, tool0[:, i]), (arm.dof + 1 + side, tcp[:, i] + shift)]
        fits = [(*enclosing_center(track), link) for link, track in choices]
        center, reach, link = min(fits, key=lambda fit: fit[1])
        grown = radius + max(0.0, reach - entry.spheres.tolerance_m)
        out.append((link, np.append(center, grown)))
    return out

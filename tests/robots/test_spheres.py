"""Spheres cover the collision geoms, padded by 10 mm, and stick out of them by less than 25 mm."""

import mujoco
import numpy as np
import pytest

from torc.robots.kinematics import sphere_centers
from torc.robots.spheres import cover_geom

PADDING_M = 0.010
BULGE_M = 0.025


def place(robot, q, width_m):
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    for name, value in zip(robot.arm.joint_names, q):
        data.joint(name).qpos = value
    for name, value in zip(robot.gripper.joint_names, robot.gripper.qpos(width_m)):
        data.joint(name).qpos = value
    mujoco.mj_kinematics(model, data)
    return model, data


def surface_points(model, geom, n, rng):
    """Points on a geom's surface, in its frame, by shooting rays at it from outside."""
    size, kind = model.geom_size[geom], model.geom_type[geom]
    directions = rng.standard_normal((n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return directions * np.min(size / np.abs(directions), axis=1, keepdims=True)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return directions * size[0] + np.outer(rng.uniform(-size[1], size[1], n), [0, 0, 1])
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        radial = directions[:, :2] / np.linalg.norm(directions[:, :2], axis=1, keepdims=True)
        side = np.column_stack([size[0] * radial, rng.uniform(-size[1], size[1], n)])
        ends = np.column_stack(
            [size[0] * radial * rng.uniform(0, 1, (n, 1)) ** 0.5, np.sign(directions[:, 2]) * size[1]]
        )
        return np.where(rng.random((n, 1)) < 0.5, side, ends)
    raise NotImplementedError(kind)


def depth_in_geoms(model, data, geoms, points):
    """Distance of points to the nearest geom; negative inside."""
    best = np.full(len(points), np.inf)
    for g in geoms:
        p = (points - data.geom_xpos[g]) @ data.geom_xmat[g].reshape(3, 3)
        size, kind = model.geom_size[g], model.geom_type[g]
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            p[:, 2] -= np.clip(p[:, 2], -size[1], size[1])
            d = np.linalg.norm(p, axis=1) - size[0]
        else:
            if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
                p = np.column_stack([np.hypot(p[:, 0], p[:, 1]), p[:, 2]])
                half = size[:2]
            else:
                half = size
            q = np.abs(p) - half
            d = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
        best = np.minimum(best, d)
    return best


def moving_geoms(robot, model, moving):
    root = model.jnt_bodyid[model.joint(robot.arm.joint_names[0]).id]
    subtree = {b for b in range(model.nbody) if b >= root and model.body_rootid[b] == model.body_rootid[root]}
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return [g for g in range(model.ngeom) if collides[g] and (model.geom_bodyid[g] in subtree) == moving]


def assert_covered(model, data, geoms, centers, radii, rng):
    """The spheres cover the geoms' surfaces, and stick out little."""
    for g in geoms:
        points = surface_points(model, g, 400, rng) @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
        gaps = np.linalg.norm(points[:, None] - centers[None], axis=-1) - radii
        assert gaps.min(axis=1).max() < PADDING_M, model.geom(g).name
    for center, radius in zip(centers, radii):
        directions = rng.standard_normal((200, 3))
        on_sphere = center + radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        assert depth_in_geoms(model, data, geoms, on_sphere).max() < BULGE_M


@pytest.mark.parametrize("share", [0.0, 0.25, 0.6, 1.0])
def test_moving_parts_are_covered_and_not_blown_up(robot, share, rng):
    width_m = share * robot.gripper.max_width_m
    for q in rng.uniform(robot.arm.lower, robot.arm.upper, (3, robot.arm.dof)):
        model, data = place(robot, q, width_m)
        centers = sphere_centers(robot, q[None], np.array([width_m]))[0]
        geoms = moving_geoms(robot, model, moving=True)
        assert len(geoms) >= 12 + robot.arm.dof - 1
        assert_covered(model, data, geoms, centers, robot.spheres.radii, rng)


def test_static_parts_are_covered_and_not_blown_up(robot, rng):
    model, data = place(robot, np.zeros(robot.arm.dof), 0.0)
    spheres = robot.static_spheres
    assert_covered(model, data, moving_geoms(robot, model, moving=False), spheres[:, :3], spheres[:, 3], rng)


@pytest.mark.parametrize("tolerance", [0.002, 0.005, 0.01])
def test_covers_leave_gaps_of_at_most_the_tolerance(tolerance, rng):
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody>"
        '<geom type="capsule" size="0.06 0.2"/>'
        '<geom type="cylinder" size="0.05 0.02"/><geom type="cylinder" size="0.03 0.2"/>'
        '<geom type="box" size="0.01 0.03 0.05"/>'
        "</worldbody></mujoco>"
    )
    for g in range(model.ngeom):
        kind = ["capsule", "cylinder", "cylinder", "box"][g]
        spheres = cover_geom(kind, model.geom_size[g], model.geom_aabb[g, 3:], tolerance)
        points = surface_points(model, g, 2000, rng)
        gaps = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=-1) - spheres[:, 3]
        assert gaps.min(axis=1).max() < tolerance + 1e-9

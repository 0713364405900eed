"""Spheres cover the collision geoms, padded by 10 mm, and stick out of them by less than 25 mm."""

import mujoco
import numpy as np
import pytest

from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers
from torc.robots.spheres import cover_box, cover_capsule, cover_cylinder, cover_geom, cover_sphere

PADDING_M = 0.010
BULGE_M = 0.025


def place(robot: RobotDescription, q: np.ndarray, width_m: float) -> tuple:
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    for name, value in zip(robot.arm_joint_names, q):
        data.joint(name).qpos = value
    for name, value in zip(robot.gripper_joint_names, robot.gripper.qpos(width_m)):
        data.joint(name).qpos = value
    mujoco.mj_kinematics(model, data)
    return model, data


def surface_points(model: mujoco.MjModel, geom: int, n: int, rng: np.random.Generator) -> np.ndarray:
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


def depth_in_geoms(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int], points: np.ndarray
) -> np.ndarray:
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


def moving_geoms(robot: RobotDescription, model: mujoco.MjModel, moving: bool) -> list[int]:
    root = model.jnt_bodyid[model.joint(robot.arm_joint_names[0]).id]
    subtree = {b for b in range(model.nbody) if b >= root and model.body_rootid[b] == model.body_rootid[root]}
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return [g for g in range(model.ngeom) if collides[g] and (model.geom_bodyid[g] in subtree) == moving]


@pytest.mark.parametrize("width_m", [0.0, 0.02, 0.05, 0.085])
def test_moving_parts_are_covered_and_not_blown_up(
    robot: RobotDescription, width_m: float, rng: np.random.Generator
) -> None:
    for q in rng.uniform(robot.arm.lower, robot.arm.upper, (3, 7)):
        model, data = place(robot, q, width_m)
        centers = sphere_centers(robot, q[None], np.array([width_m]))[0]
        geoms = moving_geoms(robot, model, moving=True)
        assert len(geoms) == 19
        for g in geoms:
            points = (
                surface_points(model, g, 400, rng) @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
            )
            gaps = np.linalg.norm(points[:, None] - centers[None], axis=-1) - robot.spheres.radii
            assert gaps.min(axis=1).max() < PADDING_M, model.geom(g).name
        for center, radius in zip(centers, robot.spheres.radii):
            directions = rng.standard_normal((200, 3))
            on_sphere = center + radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
            assert depth_in_geoms(model, data, geoms, on_sphere).max() < BULGE_M


def test_static_parts_are_covered_and_not_blown_up(robot: RobotDescription, rng: np.random.Generator) -> None:
    model, data = place(robot, np.zeros(7), 0.0)
    geoms = moving_geoms(robot, model, moving=False)
    spheres = robot.static_spheres
    for g in geoms:
        points = surface_points(model, g, 400, rng) @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
        gaps = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=-1) - spheres[:, 3]
        assert gaps.min(axis=1).max() < PADDING_M, model.geom(g).name
    for x, y, z, radius in spheres:
        directions = rng.standard_normal((200, 3))
        on_sphere = [x, y, z] + radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        assert depth_in_geoms(model, data, geoms, on_sphere).max() < BULGE_M


def test_what_is_seen_of_the_moving_robot_is_covered_too(robot: RobotDescription) -> None:
    """Corners of the bounding boxes of small visual geoms; whole links are rounder than their boxes."""
    model, data = place(robot, robot.arm.rest_qpos, 0.05)
    centers = sphere_centers(robot, robot.arm.rest_qpos[None], np.array([0.05]))[0]
    base = model.body(robot.gripper_body_name).id
    visual = [g for g in range(model.ngeom) if model.geom_group[g] == 1 and model.geom_bodyid[g] > base]
    for g in visual:
        gaps = np.linalg.norm(data.geom_xpos[g] - centers, axis=1) - robot.spheres.radii
        assert gaps.min() < PADDING_M, model.geom(g).name


def test_number_of_spheres(robot: RobotDescription) -> None:
    assert 40 <= len(robot.spheres) <= 70
    assert set(robot.spheres.link.tolist()) == set(range(10))
    assert np.all(np.diff(robot.spheres.link) >= 0)


@pytest.mark.parametrize("tolerance", [0.002, 0.005, 0.01])
def test_covers_leave_gaps_of_at_most_the_tolerance(tolerance: float, rng: np.random.Generator) -> None:
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


def test_a_finer_tolerance_takes_more_spheres() -> None:
    assert len(cover_capsule(0.05, 0.3, 0.002)) > len(cover_capsule(0.05, 0.3, 0.01))
    assert len(cover_capsule(0.05, 0.0, 0.002)) == 1
    assert len(cover_sphere(0.1)) == 1
    assert len(cover_cylinder(0.05, 0.2, 0.005)) == 4
    assert len(cover_box(np.array([0.01, 0.02, 0.03]), 0.005)) == 6

"""A robot as cuRobo reads it is the robot: the same places, spheres and limits, by a plain reading of the files."""

import xml.etree.ElementTree as ElementTree
from itertools import combinations

import numpy as np
import pytest
import yaml
from curobo_robot import write_curobo_robot

from torc.collision.collision_world import CollisionConfig
from torc.geometry.transforms import make_pose, rotation_about
from torc.robots.kinematics import link_poses, sphere_centers


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = write_curobo_robot("sda10f_2f85", tmp_path_factory.mktemp("curobo"))
    config = yaml.safe_load(path.read_text())["kinematics"]
    return config, ElementTree.parse(config["urdf_path"]).getroot()


def _numbers(element, name):
    return np.array([float(n) for n in element.get(name).split()])


def _places(urdf, qpos):
    """Poses of the links, by the rules of URDF: fixed-axis roll, pitch, yaw, then the joint's turn."""
    turns = dict(qpos)
    poses = {"world": np.eye(4)}
    for joint in urdf.iter("joint"):
        roll, pitch, yaw = _numbers(joint.find("origin"), "rpy")
        R = (
            rotation_about([0, 0, 1], yaw)
            @ rotation_about([0, 1, 0], pitch)
            @ rotation_about([1, 0, 0], roll)
        )
        T = poses[joint.find("parent").get("link")] @ make_pose(R, _numbers(joint.find("origin"), "xyz"))
        if joint.get("type") == "revolute":
            T = T @ make_pose(rotation_about(_numbers(joint.find("axis"), "xyz"), turns[joint.get("name")]))
        poses[joint.find("child").get("link")] = T
    return poses


def test_the_links_are_where_they_are(written, robot, rng):
    _, urdf = written
    arm = robot.arm
    for q in rng.uniform(arm.lower, arm.upper, (5, arm.dof)):
        poses = _places(urdf, zip(arm.joint_names, q))
        expected = link_poses(arm, q[None])[0]
        for name, T in zip([*(f"link_{i + 1}" for i in range(arm.dof)), "tool0"], expected):
            np.testing.assert_allclose(poses[name], T, atol=1e-8)


def test_the_spheres_are_where_they_are_and_larger_by_the_padding(written, robot, rng):
    config, urdf = written
    arm, width = robot.arm, robot.gripper.max_width_m
    q = rng.uniform(arm.lower, arm.upper)
    poses, found = _places(urdf, zip(arm.joint_names, q)), []
    for link, spheres in config["collision_spheres"].items():
        if link != "world":
            room = CollisionConfig().gripper_padding_m if link == "tool0" else CollisionConfig().padding_m
            assert config["self_collision_buffer"][link] == -room
            found += [[*(poses[link] @ [*s["center"], 1])[:3], s["radius"] - room] for s in spheres]
    expected = np.column_stack([sphere_centers(robot, q[None], np.array([width]))[0], robot.spheres.radii])
    assert len(found) == len(expected)
    for row in expected:
        assert np.abs(np.array(found) - row).max(axis=1).min() < 1e-5
    still = [[*s["center"], s["radius"]] for s in config["collision_spheres"]["world"]]
    np.testing.assert_allclose(still, robot.static_spheres, atol=1e-5)


def test_joints_and_limits_are_the_arms(written, robot):
    config, urdf = written
    arm, limits = robot.arm, [j.find("limit") for j in urdf.iter("joint") if j.get("type") == "revolute"]
    assert tuple(config["cspace"]["joint_names"]) == arm.joint_names
    for name, values in (("lower", arm.lower), ("upper", arm.upper), ("velocity", arm.max_speed)):
        np.testing.assert_allclose([float(limit.get(name)) for limit in limits], values, rtol=1e-8)
    np.testing.assert_allclose(config["cspace"]["max_acceleration"], arm.max_acceleration)
    np.testing.assert_allclose(config["cspace"]["default_joint_position"], arm.rest_qpos)


def test_the_pairs_that_torc_checks_are_checked_and_no_others(written, robot):
    config, _ = written
    dof = robot.arm.dof
    ignored = {frozenset((a, b)) for a, others in config["self_collision_ignore"].items() for b in others}
    names = [*(f"link_{i + 1}" for i in range(dof)), *["tool0"] * 3]
    checked = {frozenset((names[a], names[b])) for a, b in robot.self_pairs}
    checked |= {frozenset(("world", names[k])) for k in robot.static_links}
    checked |= {frozenset(("attached_object", n)) for n in ("world", *names[: dof - 1])}
    every = {frozenset(pair) for pair in combinations(config["collision_link_names"], 2)}
    assert every - ignored == checked
    assert ignored <= every

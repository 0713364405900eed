"""From a robot file and its MJCF to a RobotDescription.

Kinematics, limits and shapes are read from the compiled MJCF, so that the simulator and the planners can never
disagree about the robot.
"""

from itertools import combinations
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from torc.errors import InputError
from torc.geometry.transforms import invert
from torc.robots.description import ArmDescription, RobotDescription
from torc.robots.gripper_parsing import parse_gripper
from torc.robots.model import Model
from torc.robots.mujoco_log import warnings_in_the_log
from torc.robots.rest import check_rest
from torc.robots.schema import ArmEntry, RobotFile, read_robot_file
from torc.robots.source import robot_source
from torc.robots.sphere_parsing import parse_spheres, static_spheres


def parse_robot(path: Path) -> RobotDescription:
    """Read a robot file. Raises InputError naming the file and what is wrong with it."""
    entry = read_robot_file(path)
    mjcf_path = (path.parent / entry.mjcf).resolve()
    compiled = _compile(mjcf_path)
    source = robot_source(entry, compiled)  # before it is posed for what is read from it
    model = Model(path, compiled)
    arm = _parse_arm(model, entry.arm)
    gripper = parse_gripper(model, entry)
    links = _links(model, entry)
    spheres = parse_spheres(model, entry, arm, gripper, links)
    fingers = entry.gripper.fingers
    robot = RobotDescription(
        name=entry.name,
        arm=arm,
        gripper=gripper,
        spheres=spheres,
        static_spheres=static_spheres(model, links, entry.spheres.tolerance_m),
        self_pairs=_self_pairs(model, entry, links, arm.dof),
        static_links=_static_links(model, entry, links, arm.dof),
        mjcf_path=mjcf_path,
        arm_actuator_names=tuple(model.check("actuator", n) for n in entry.arm.actuators),
        gripper_actuator_name=model.check("actuator", entry.gripper.actuator),
        gripper_body_name=entry.gripper.body,
        finger_body_names=(fingers[0].body, fingers[1].body),
        pad_geom_names=(tuple(fingers[0].pad_geoms), tuple(fingers[1].pad_geoms)),
        tip_site_names=(fingers[0].tip_site, fingers[1].tip_site),
        tool0_site_name=entry.arm.tool0_site,
        root_body_names=tuple(model.m.body(b).name for b in model.children(0)),
        source=source,
    )
    check_rest(robot, path)
    return robot


def _compile(mjcf_path: Path) -> Any:
    if not mjcf_path.is_file():
        raise InputError(f"There is no MJCF file {mjcf_path}; the robot file's `mjcf` is relative to itself.")
    try:
        with warnings_in_the_log():
            return mujoco.MjModel.from_xml_path(str(mjcf_path))
    except ValueError as error:
        raise InputError(f"MuJoCo cannot compile {mjcf_path}: {error}") from error


def _parse_arm(model: Model, entry: ArmEntry) -> ArmDescription:
    m = model.m
    ids = [model.id("joint", name) for name in entry.joints]
    _check_chain(model, entry, ids)
    model.place({})
    Ts = np.array([model.joint_pose(j) for j in ids])
    base = model.body_pose(int(m.body_parentid[m.jnt_bodyid[ids[0]]]))
    tool0 = model.site_pose(entry.tool0_site)
    before = np.concatenate([base[None], Ts[:-1]])
    speed = np.minimum(entry.speed_deg_s, entry.hardware_speed_deg_s)
    lower, upper = m.jnt_range[ids, 0].copy(), m.jnt_range[ids, 1].copy()
    rest = np.array(entry.rest_qpos_rad, dtype=float)
    if np.any((rest < lower) | (rest > upper)):
        raise InputError(f"{model.path}: arm.rest_qpos_rad is outside the joint limits of the MJCF.")
    return ArmDescription(
        joint_names=tuple(entry.joints),
        Ts_parent_joint=invert(before) @ Ts,
        axes=m.jnt_axis[ids].copy(),
        T_world_base=base,
        T_last_tool0=invert(Ts[-1]) @ tool0,
        lower=lower,
        upper=upper,
        max_speed=np.deg2rad(speed),
        max_acceleration=np.full(len(ids), np.deg2rad(entry.acceleration_deg_s2)),
        rest_qpos=rest,
    )


def _check_chain(model: Model, entry: ArmEntry, ids: list[int]) -> None:
    m, above = model.m, 0
    for name, j in zip(entry.joints, ids):
        if m.jnt_type[j] != mujoco.mjtJoint.mjJNT_HINGE or not m.jnt_limited[j]:
            raise InputError(f"{model.path}: arm joint '{name}' must be a hinge with a range in the MJCF.")
        body = int(m.jnt_bodyid[j])
        between = model.ancestors(body, stop=above)
        if any(m.body_jntnum[b] for b in between[1:]) or m.body_jntnum[body] != 1:
            raise InputError(
                f"{model.path}: the MJCF has a joint between '{name}' and the arm joint before it."
            )
        if above and above not in model.ancestors(body):
            raise InputError(f"{model.path}: arm joint '{name}' is not further out than the one before it.")
        above = body


def _links(model: Model, entry: RobotFile) -> np.ndarray:
    """Per body the link number of SphereModel; -1 static, -2 a part of the gripper that is neither body nor finger."""
    m, dof = model.m, len(entry.arm.joints)
    own = {int(m.jnt_bodyid[model.id("joint", n)]): i for i, n in enumerate(entry.arm.joints)}
    own[model.id("body", entry.gripper.body)] = dof
    own |= {model.id("body", f.body): dof + 1 + i for i, f in enumerate(entry.gripper.fingers)}
    links = np.full(m.nbody, -1)
    for body in range(1, m.nbody):
        inherited = links[m.body_parentid[body]]
        if m.body_jntnum[body] and body not in own:
            if inherited not in (dof, -2):
                raise InputError(
                    f"{model.path}: body '{m.body(body).name}' moves, but belongs neither to the arm nor to the "
                    "gripper. Remove its joint from the MJCF."
                )
            inherited = -2
        links[body] = own.get(body, inherited)
    return links


def _link_of(model: Model, links: np.ndarray, body_name: str) -> int:
    link = int(links[model.id("body", body_name)])
    if link < 0:
        raise InputError(f"{model.path}: self_collision names '{body_name}', which is no link that moves.")
    return link


def _self_pairs(model: Model, entry: RobotFile, links: np.ndarray, dof: int) -> np.ndarray:
    """The pairs of the file; by default all at least two joints apart, the whole gripper being one with its flange."""
    if entry.self_collision.pairs is not None:
        named = [sorted(_link_of(model, links, name) for name in pair) for pair in entry.self_collision.pairs]
        return np.array(named, dtype=np.int64).reshape(-1, 2)
    pairs = [(i, j) for i, j in combinations(range(dof + 3), 2) if min(j, dof) - i >= 2 and i < dof - 1]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _static_links(model: Model, entry: RobotFile, links: np.ndarray, dof: int) -> tuple[int, ...]:
    never = {_link_of(model, links, n) for n in entry.self_collision.never_with_static}
    return tuple(i for i in range(dof + 3) if i not in never)

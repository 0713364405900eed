"""Prove a robot file before it is used.

Does each actuator move its own joint, does the gripper close at the upper end of its control range, do the fingertips
point outward? This is tried in a copy of the model, without gravity and contacts. A robot that fails would miss every
pick for no visible reason.
"""

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.io.reading import read_text
from torc.robots.description import RobotDescription
from torc.robots.kinematics import sphere_centers

_TIMESTEP_S, _STEPS_S, _SETTLES_S = 0.002, 0.5, 3.0
_LEAST_RAD, _STEP_RAD = 0.02, 0.01
"""Each joint is commanded to another angle, which exposes one that follows another joint's command."""
_FOLLOWED = 0.4
"""Share of the command by which a joint may be off: servos are soft."""
_CLOSED_SHARE = 0.25
_OUTWARD = 0.5
"""Least cosine between the fingertips' approach direction and the direction from the flange to them."""
_ROOT = re.compile(r"<\s*(?![?!])([\w:.-]+)")
"""The first element. No XML reader is asked: a xacro often uses a prefix that it does not declare."""


def refuse_urdf(mjcf_path: Path) -> None:
    """Raise InputError if a file that should be an MJCF is a URDF or xacro. Unreadable files are left to MuJoCo."""
    try:
        text = read_text(mjcf_path, "replace")
    except OSError:
        return
    root = _ROOT.search(re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL))
    if root and root.group(1) == "robot":
        raise InputError(
            f"{mjcf_path} is a URDF or a xacro, not an MJCF. Make a URDF of a xacro first (`xacro robot.urdf.xacro > "
            "robot.urdf`). Write its meshes' paths as files, not package://, then convert it: `model = "
            "mujoco.MjModel.from_xml_path('robot.urdf')`, `mujoco.mj_saveLastXML('robot.xml', model)`. Add position "
            "actuators and the tool's site."
        )


def robot_faults(robot: RobotDescription, model: Any) -> dict[str, list[str]]:
    """Return everything that would keep a robot from picking, by part. The model is unchanged."""
    world = _world_faults(model)
    return {
        "surroundings": world,
        "arm": _arm_faults(robot, model),
        "gripper": _gripper_faults(robot, model),
        "fingertips": _tip_faults(robot),
        # Its own floor would be in everything's way.
        "rest": [] if world else _rest_faults(robot),
    }


def sags_rad(robot: RobotDescription, model: Any) -> Float[np.ndarray, "n"]:
    """Return how far each joint of the arm sags under the arm's weight, from rest, in half a second."""
    data = _posed(robot, model)
    data.ctrl[[model.actuator(name).id for name in robot.arm_actuator_names]] = robot.arm.rest_qpos
    _run(model, data, _STEPS_S, gravity=True)
    qpos = data.qpos[model.jnt_qposadr[[model.joint(name).id for name in robot.arm.joint_names]]]
    return np.abs(qpos - robot.arm.rest_qpos)


def _world_faults(m: Any) -> list[str]:
    planes = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
    found = []
    for g in range(m.ngeom):
        name = m.geom(g).name or f"number {g}"
        if int(m.geom_type[g]) in planes:
            found.append(f"the MJCF holds a plane ({name}); torc adds its own floor and table: remove it")
        elif m.geom_bodyid[g] == 0 and (m.geom_contype[g] or m.geom_conaffinity[g]):
            found.append(
                f"the MJCF holds a geom of the world ({name}); torc adds floor and table: remove it, or put it into a "
                "body if it belongs to the robot"
            )
    for j in np.flatnonzero(m.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)):
        name = m.joint(j).name or f"number {j}"
        found.append(f"the MJCF holds something that moves freely (joint {name}): remove it")
    return found


def _arm_faults(robot: RobotDescription, m: Any) -> list[str]:
    joints = [m.joint(name).id for name in robot.arm.joint_names]
    actuators = [m.actuator(name).id for name in robot.arm_actuator_names]
    start = robot.arm.rest_qpos
    # Away from the nearer limit.
    signs = np.where(robot.arm.upper - start > start - robot.arm.lower, 1.0, -1.0)
    wanted = signs * (_LEAST_RAD + _STEP_RAD * np.arange(len(joints)))
    data = _posed(robot, m)
    data.ctrl[actuators] = start + wanted
    _run(m, data, _SETTLES_S)
    moved = data.qpos[m.jnt_qposadr[joints]] - start
    if not np.isfinite(moved).all():
        return ["the arm's simulation diverges: look at gains, masses and armature in the MJCF"]
    found = []
    for i, name in enumerate(robot.arm.joint_names):
        if abs(moved[i] - wanted[i]) <= _FOLLOWED * abs(wanted[i]):
            continue
        why = _actuator_fault(m, actuators[i], joints[i])
        why = why or f"it moved the joint by {moved[i]:+.3f} rad instead of {wanted[i]:+.3f}"
        actuator = robot.arm_actuator_names[i]
        found.append(
            f"the actuator '{actuator}' does not bring the joint '{name}' where it is commanded: {why}"
        )
    return found


def _actuator_fault(m: Any, actuator: int, joint: int) -> str:
    """Return why an actuator is not a position servo of a joint, judged by its entries; "" if they do not say."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    other = int(m.actuator_trnid[actuator, 0])
    if int(m.actuator_trntype[actuator]) in kinds and other != joint:
        return (
            f"it drives the joint '{m.joint(other).name}'. Are the names in the robot file in the same order?"
        )
    _, position, speed = m.actuator_biasprm[actuator, :3]
    affine = int(m.actuator_biastype[actuator]) == int(mujoco.mjtBias.mjBIAS_AFFINE)
    if not affine or position == speed == 0:
        return "it is a motor; a position servo (<position>) is needed"
    if position == 0:
        return "it is a velocity servo; a position servo (<position>) is needed"
    gear = float(m.actuator_gear[actuator, 0])
    if gear != 1:
        return f"its gear is {gear:g}, so its command is not the joint's angle; set gear to 1"
    if not np.isclose(m.actuator_gainprm[actuator, 0], -position):
        return "its gain and bias differ, so its command is not the joint's angle"
    low, high = m.actuator_ctrlrange[actuator]
    if m.actuator_ctrllimited[actuator] and (low, high) != tuple(m.jnt_range[joint]):
        return f"its ctrlrange is {low:g} to {high:g}: too narrow, or in degrees"
    return ""


def _gripper_faults(robot: RobotDescription, m: Any) -> list[str]:
    name = robot.gripper_actuator_name
    actuator = m.actuator(name).id
    if not m.actuator_ctrllimited[actuator]:
        return [f"the gripper's actuator '{name}' needs a ctrlrange, whose upper end closes the gripper"]
    widths = []
    for end in m.actuator_ctrlrange[actuator]:
        data = _posed(robot, m)
        data.ctrl[actuator] = end
        data.ctrl[[m.actuator(a).id for a in robot.arm_actuator_names]] = robot.arm.rest_qpos
        _run(m, data, _SETTLES_S)
        low, high = (data.site(tip).xpos for tip in robot.tip_site_names)
        widths.append(float(np.linalg.norm(high - low)))
    at_lower, at_upper = widths
    most = robot.gripper.max_width_m
    listed = f"it opens {1e3 * at_lower:.0f} mm at the lower end and {1e3 * at_upper:.0f} mm at the upper end"
    if at_upper > at_lower + _CLOSED_SHARE * most:
        return [
            f"the gripper opens at the upper end of the ctrlrange of '{name}' ({listed}); torc closes it there. Drive "
            "the joint the other way (its axis and range), or through a tendon with coefficient -1"
        ]
    if not at_upper < at_lower - _CLOSED_SHARE * most:
        return [
            f"the actuator '{name}' does not close the gripper: {listed}; max_width_m is {1e3 * most:.0f} mm"
        ]
    return []


def _tip_faults(robot: RobotDescription) -> list[str]:
    T = robot.gripper.T_tool0_tcp(0.5 * robot.gripper.max_width_m)
    reach = float(np.linalg.norm(T[:3, 3]))
    if reach < 1e-3 or float(T[:3, 2] @ T[:3, 3]) / reach >= _OUTWARD:
        return []
    return [
        f"the fingertips of {robot.gripper.name} do not point outward: z of their sites must point the way in which "
        "the gripper approaches, from the flange to the tips and beyond. Turn the tip sites"
    ]


def _rest_faults(robot: RobotDescription) -> list[str]:
    """Return the first checked parts that touch at rest with the gripper open."""
    width_m = np.array([robot.gripper.max_width_m])
    centers = sphere_centers(robot, robot.arm.rest_qpos[None], width_m)[0]
    spheres = np.column_stack([centers, robot.spheres.radii])
    names = (*robot.arm.joint_names, "gripper", "finger -x", "finger +x")
    of_link = [spheres[robot.spheres.link == i] for i in range(len(names))]
    for i in robot.static_links:
        if _touch(of_link[i], robot.static_spheres):
            return [
                f"at rest_qpos_rad what '{names[i]}' moves touches the robot's fixed parts. If it always does, name "
                "its body in self_collision.never_with_static"
            ]
    for i, j in robot.self_pairs.tolist():
        if _touch(of_link[i], of_link[j]):
            return [
                f"at rest_qpos_rad what '{names[i]}' and '{names[j]}' move touch each other. If they always do, give "
                "self_collision.pairs without the two"
            ]
    return []


def _touch(a: np.ndarray, b: np.ndarray) -> bool:
    """Check whether any sphere (x, y, z, radius) of one overlaps one of the other."""
    distance = np.linalg.norm(a[:, None, :3] - b[None, :, :3], axis=2)
    return bool((distance < a[:, None, 3] + b[None, :, 3]).any())


def _posed(robot: RobotDescription, m: Any) -> Any:
    """Return the model's state with the arm at rest and the gripper open."""
    data = mujoco.MjData(m)
    gripper, arm = robot.gripper, robot.arm
    names, open_qpos = (*gripper.joint_names, *arm.joint_names), gripper.qpos(gripper.max_width_m)
    data.qpos[m.jnt_qposadr[[m.joint(name).id for name in names]]] = [*open_qpos, *arm.rest_qpos]
    return data


def _run(m: Any, data: Any, most_s: float, gravity: bool = False) -> None:
    """Step without contacts until nothing moves, or the time is over."""
    before = m.opt.disableflags, m.opt.integrator, m.opt.timestep
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    if not gravity:
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    # As in the simulated world, whatever the robot's file says.
    m.opt.integrator, m.opt.timestep = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST), _TIMESTEP_S
    try:
        steps = round(_STEPS_S / _TIMESTEP_S)
        for _ in range(round(most_s / _STEPS_S)):
            mujoco.mj_step(m, data, nstep=steps)
            if np.abs(data.qvel).max(initial=0.0) < 1e-4:
                break
        mujoco.mj_kinematics(m, data)
    finally:
        m.opt.disableflags, m.opt.integrator, m.opt.timestep = before

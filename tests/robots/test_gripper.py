"""The gripper's tables against MuJoCo, by kinematics and by really driving the simulated gripper."""

import mujoco
import numpy as np
import pytest

from torc.errors import InputError


def tips_in_tool0(robot, data):
    tool0 = data.site(robot.tool0_site_name)
    tips = np.array([data.site(n).xpos for n in robot.tip_site_names])
    return (tips - tool0.xpos) @ tool0.xmat.reshape(3, 3)


def simulate(robot, width_m):
    """Drive the gripper to an opening, starting closed, with the arm held at rest."""
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, 0.002
    data = mujoco.MjData(model)
    for name, actuator, q in zip(robot.arm.joint_names, robot.arm_actuator_names, robot.arm.rest_qpos):
        data.joint(name).qpos, data.actuator(actuator).ctrl = q, q
    for name, q in zip(robot.gripper.joint_names, robot.gripper.qpos(0.0)):
        data.joint(name).qpos = q
    data.actuator(robot.gripper_actuator_name).ctrl = robot.gripper.ctrl(width_m)
    mujoco.mj_step(model, data, nstep=1000)
    mujoco.mj_kinematics(model, data)
    return model, data


def test_tcp_is_between_the_pads_for_every_opening(robot):
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    for width in np.linspace(0.0, 0.085, 41):
        for name, q in zip(robot.gripper.joint_names, robot.gripper.qpos(width)):
            data.joint(name).qpos = q
        mujoco.mj_kinematics(model, data)
        tips = tips_in_tool0(robot, data)
        T = robot.gripper.T_tool0_tcp(width)
        np.testing.assert_allclose(tips.mean(axis=0), T[:3, 3], atol=1e-5)
        np.testing.assert_allclose(tips[1] - tips[0], width * T[:3, 0], atol=1e-5)


@pytest.mark.parametrize("width_m", [0.0, 0.01, 0.04, 0.085])
def test_command_for_an_opening_reaches_it(robot, width_m):
    _, data = simulate(robot, width_m)
    tips = tips_in_tool0(robot, data)
    assert tips[1, 0] - tips[0, 0] == pytest.approx(width_m, abs=5e-4)
    np.testing.assert_allclose(tips.mean(axis=0), robot.gripper.T_tool0_tcp(width_m)[:3, 3], atol=5e-4)


def test_grip_force_is_what_was_asked_for(robot):
    """Close on a fixed block of 40 mm: the contact force on each pad, against the law of virtual work."""
    spec = mujoco.MjSpec.from_file(str(robot.mjcf_path))
    spec.option.timestep, spec.option.cone = 0.002, mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    base = spec.body(robot.gripper_body_name)
    z = robot.gripper.T_tool0_tcp(0.04)[2, 3] - 0.015
    block = base.add_body(name="block", pos=[0, 0, z])
    block.add_geom(name="block", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.02, 0.02, 0.01])
    spec.add_exclude(bodyname1="block", bodyname2=robot.gripper_body_name)
    model = spec.compile()
    data = mujoco.MjData(model)
    for name, actuator, q in zip(robot.arm.joint_names, robot.arm_actuator_names, robot.arm.rest_qpos):
        data.joint(name).qpos, data.actuator(actuator).ctrl = q, q
    motor = model.actuator(robot.gripper_actuator_name).id
    force = robot.gripper.actuator_force(40.0, 0.04)
    model.actuator_forcerange[motor] = -force, force
    data.ctrl[motor] = model.actuator_ctrlrange[motor, 1]
    mujoco.mj_step(model, data, nstep=1500)
    presses = {True: 0.0, False: 0.0}
    for i in range(data.ncon):
        names = {model.geom(data.contact[i].geom1).name, model.geom(data.contact[i].geom2).name}
        wrench = np.zeros(6)
        mujoco.mj_contactForce(model, data, i, wrench)
        presses[bool(names & set(robot.pad_geom_names[0]))] += wrench[0]
    assert presses[True] == pytest.approx(40.0, rel=0.1)
    assert presses[False] == pytest.approx(40.0, rel=0.1)


def test_boxes_hold_all_of_the_gripper(robot):
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    base = model.body(robot.gripper_body_name).id
    for width in (0.0, 0.03, 0.085):
        for name, q in zip(robot.gripper.joint_names, robot.gripper.qpos(width)):
            data.joint(name).qpos = q
        mujoco.mj_kinematics(model, data)
        boxes = [*robot.gripper.finger_boxes(width), *robot.gripper.palm_boxes(width)]
        tool0, tcp = data.site(robot.tool0_site_name), robot.gripper.T_tool0_tcp(width)[:3, 3]
        for g in np.flatnonzero(model.geom_bodyid >= base):
            p = (data.geom_xpos[g] - tool0.xpos) @ tool0.xmat.reshape(3, 3) - tcp
            assert any(np.all(np.abs(p - b.center) <= b.half_size + 0.004) for b in boxes), model.geom(g).name


def test_finger_boxes_leave_exactly_the_opening_between_them(robot):
    for width in (0.0, 0.013, 0.085):
        low, high = robot.gripper.finger_boxes(width)
        assert high.center[0] - high.half_size[0] == pytest.approx(width / 2, abs=1e-5)
        assert low.center[0] + low.half_size[0] == pytest.approx(-width / 2, abs=1e-5)
        assert high.center[2] + high.half_size[2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("width_m", [-0.001, 0.0851, np.nan])
def test_openings_it_does_not_have(robot, width_m):
    with pytest.raises(InputError, match="opens 0"):
        robot.gripper.T_tool0_tcp(width_m)


def test_many_openings_at_once_are_those_one_by_one(robot):
    gripper = robot.gripper
    widths = np.concatenate([np.linspace(0.0, gripper.max_width_m, 50), gripper.widths_m])
    one_by_one = np.stack([gripper.T_tool0_tcp(float(w)) for w in widths])
    np.testing.assert_array_equal(gripper.Ts_tool0_tcp_at(widths), one_by_one)
    assert gripper.Ts_tool0_tcp_at(np.zeros(0)).shape == (0, 4, 4)
    with pytest.raises(InputError, match=r"asked for 0\.2"):
        gripper.Ts_tool0_tcp_at(np.array([0.05, 0.2, 0.01]))

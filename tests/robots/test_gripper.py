"""The gripper's tables against MuJoCo, by kinematics and by really driving the simulated gripper."""

import mujoco
import numpy as np
import pytest

from torc.errors import InputError


def tips_in_tool0(robot, data):
    tool0 = data.site(robot.tool0_site_name)
    tips = np.array([data.site(n).xpos for n in robot.tip_site_names])
    return (tips - tool0.xpos) @ tool0.xmat.reshape(3, 3)


def test_tcp_is_between_the_pads_for_every_opening(robot):
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    for width in np.linspace(0.0, robot.gripper.max_width_m, 41):
        for name, q in zip(robot.gripper.joint_names, robot.gripper.qpos(width)):
            data.joint(name).qpos = q
        mujoco.mj_kinematics(model, data)
        tips = tips_in_tool0(robot, data)
        T = robot.gripper.T_tool0_tcp(width)
        np.testing.assert_allclose(tips.mean(axis=0), T[:3, 3], atol=1e-5)
        np.testing.assert_allclose(tips[1] - tips[0], width * T[:3, 0], atol=1e-5)


def test_boxes_hold_all_of_the_gripper(robot):
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf_path))
    data = mujoco.MjData(model)
    base = model.body(robot.gripper_body_name).id
    for width in (0.0, 0.03, robot.gripper.max_width_m):
        for name, q in zip(robot.gripper.joint_names, robot.gripper.qpos(width)):
            data.joint(name).qpos = q
        mujoco.mj_kinematics(model, data)
        boxes = [*robot.gripper.finger_boxes(width), *robot.gripper.palm_boxes(width)]
        tool0, tcp = data.site(robot.tool0_site_name), robot.gripper.T_tool0_tcp(width)
        for g in np.flatnonzero(model.geom_bodyid >= base):
            p = ((data.geom_xpos[g] - tool0.xpos) @ tool0.xmat.reshape(3, 3) - tcp[:3, 3]) @ tcp[:3, :3]
            assert any(np.all(np.abs(p - b.center) <= b.half_size + 0.004) for b in boxes), model.geom(g).name


def test_finger_boxes_leave_exactly_the_opening_between_them(robot):
    for width in (0.0, 0.013, robot.gripper.max_width_m):
        low, high = robot.gripper.finger_boxes(width)
        assert high.center[0] - high.half_size[0] == pytest.approx(width / 2, abs=1e-5)
        assert low.center[0] + low.half_size[0] == pytest.approx(-width / 2, abs=1e-5)
        assert high.center[2] + high.half_size[2] == pytest.approx(0.0, abs=1e-9)


def test_openings_it_does_not_have(robot):
    for width_m in (-0.001, robot.gripper.max_width_m + 0.0001, np.nan):
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

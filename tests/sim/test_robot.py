"""The simulated robot carries out picks, stops on contact, and tells the truth about what came of it."""

from dataclasses import replace

import numpy as np
import pytest
from sim_scenes import TABLE_Z, grasp_pose, move, reach, retract, row, shift_up, standing, world_of

from torc.errors import InputError
from torc.pipeline.touch import finger_ends
from torc.records import PickPlan, PickResult
from torc.robots.kinematics import tcp_pose
from torc.robots.loading import load_robot
from torc.robots.protocols import ContactGuard
from torc.sim.robot import SimulatedRobot
from torc.sim.simulated_world import Presence, World, save_state
from torc.workspace.workspace_files import load_workspace

ROBOT = load_robot()
REST = ROBOT.arm.rest_qpos
WIDTH_M = 0.05
DROP_AT = load_workspace().drop_position


def plan_pick(object_id: int, T_world_tcp: np.ndarray, drop_at: tuple[float, float, float]) -> PickPlan:
    """A pick by straight joint motions, for scenes so empty that nothing is in the way."""
    q_pre = reach(ROBOT, retract(T_world_tcp, 0.1), WIDTH_M, REST)
    q_grasp = reach(ROBOT, T_world_tcp, WIDTH_M, q_pre)
    q_lift = reach(ROBOT, shift_up(T_world_tcp, 0.2), WIDTH_M, q_grasp)
    q_drop = reach(ROBOT, grasp_pose(drop_at, 0.9, -1.3), WIDTH_M, q_lift)
    return PickPlan(
        object_id=object_id,
        grasp_index=0,
        T_world_tcp=T_world_tcp,
        width_m=WIDTH_M,
        free=move(REST, q_pre, 2.0),
        approach=move(q_pre, q_grasp, 1.0),
        lift=move(q_grasp, q_lift, 1.0),
        transfer=move(q_lift, q_drop, 2.0),
        home=move(q_drop, REST, 1.5),
        grasps_tried=1,
    )


def plan_for(world: World, object_id: int, drop_at=DROP_AT, offset=(0.0, 0.0, 0.04)) -> PickPlan:
    grasp = grasp_pose(tuple(world.positions[object_id] + offset), 0.8)
    return plan_pick(object_id, grasp, drop_at)


@pytest.fixture
def world():
    return world_of(
        standing("target", "carton", 0.62, -0.15), standing("other", "carton", 0.60, 0.15), robot=ROBOT
    )


@pytest.mark.parametrize("limit", ["ctrl", "force"])
def test_a_gripper_that_could_never_close_is_refused(world, limit):
    actuator = world.model.actuator(ROBOT.gripper_actuator_name).id
    getattr(world.model, f"actuator_{limit}limited")[actuator] = False
    with pytest.raises(InputError, match=f"needs a {limit}range"):
        SimulatedRobot(world)


def test_a_box_is_retrieved(world):
    robot = SimulatedRobot(world)
    outcome = robot.execute(plan_for(world, 0))
    assert outcome.result is PickResult.RETRIEVED
    assert outcome.held_after_lift
    assert outcome.held_id == 0
    assert outcome.delivered
    assert outcome.dropped == ()
    assert not outcome.target_lost
    assert world.presence.tolist() == [Presence.DELIVERED, Presence.PRESENT]
    assert np.allclose(robot.arm.qpos, REST, atol=0.01)
    assert 5.0 < outcome.duration_s < 15.0


def test_the_same_pick_twice_is_identical_and_watching_changes_nothing():
    states, frames = [], []
    for observer in (None, lambda w: frames.append(w.update_kinematics())):
        world = world_of(*row("carton", "soup_can_red"), robot=ROBOT)
        SimulatedRobot(world, observer=observer).execute(plan_for(world, 0))
        states.append(save_state(world))
    assert np.array_equal(*states)
    assert len(frames) > 100


def test_grasping_air_misses(world):
    outcome = SimulatedRobot(world).execute(plan_for(world, 0, offset=(0.0, 0.0, 0.16)))
    assert outcome.result is PickResult.MISSED
    assert outcome.held_id is None
    assert not outcome.held_after_lift
    assert world.present.all()


def test_where_a_finger_stands_on_an_object_the_robot_knows(world):
    """The outcome tells how the arm was; with the way back added, one finger's end lies on the top."""
    robot = SimulatedRobot(world)
    beside = tuple(world.positions[0] + [0.0, 0.05, 0.04])
    outcome = robot.execute(plan_pick(0, grasp_pose(beside, 1.2), DROP_AT))
    assert outcome.result is PickResult.STOPPED
    assert outcome.touch is not None
    pose = tcp_pose(ROBOT, np.array(outcome.touch.qpos), outcome.touch.width_m)
    ends = finger_ends(pose, ROBOT.gripper, outcome.touch.width_m)
    lowest = [end[:, 2].mean() + outcome.touch.relief_m * pose[2, 2] for end in ends]
    top = world.positions[0, 2] + 0.5 * world.models[0].size_m[2]
    assert np.abs(np.array(lowest) - top).min() < 0.004
    assert robot.execute(plan_for(world, 0)).touch is None


def test_an_arm_that_is_held_up_stays_where_it_is(world):
    """It does not leap to its goal once what held it up is gone."""
    robot = SimulatedRobot(world)
    above = reach(ROBOT, grasp_pose((0.62, 0.0, TABLE_Z + 0.08), 0.8), 0.085, REST)
    inside = reach(ROBOT, grasp_pose((0.62, 0.0, TABLE_Z - 0.10), 0.8), 0.085, above)
    robot.arm.follow(move(REST, above, 2.0))
    result = robot.arm.follow(move(above, inside, 2.0))
    assert not result.reached
    assert "short of the goal" in result.detail
    assert np.abs(result.qpos - inside).max() > 0.15
    world.set_object_pose(0, np.array([0.6, 0.4, TABLE_Z + 0.1]), np.array([1.0, 0, 0, 0]))
    robot.wait_for_rest()
    assert np.abs(robot.arm.qpos - result.qpos).max() < 0.05


def test_a_target_let_go_beside_the_bin_is_lost(world):
    plan = replace(plan_for(world, 0, drop_at=(0.24, -0.60, 1.20)), is_target=True)
    outcome = SimulatedRobot(world).execute(plan)
    assert outcome.result is PickResult.SLIPPED
    assert outcome.held_after_lift
    assert outcome.target_lost
    assert outcome.dropped == ()
    assert world.presence[0] == Presence.DROPPED
    # No gripper feels where a thing lands that it let go.
    assert outcome.as_felt.result is PickResult.RETRIEVED


def test_an_object_pushed_off_the_table_is_a_drop(world):
    robot = SimulatedRobot(world)
    world.set_object_pose(1, np.array([0.6, 0.8, TABLE_Z - 0.2]), np.array([1.0, 0, 0, 0]))
    outcome = robot.execute(plan_for(world, 0))
    assert outcome.result is PickResult.RETRIEVED
    assert outcome.dropped == (1,)
    assert world.presence[1] == Presence.DROPPED


def test_the_guard_stops_at_a_heavy_block_and_backs_off():
    world = world_of(standing("anvil", "anvil", 0.78, -0.15), robot=ROBOT)
    robot = SimulatedRobot(world)
    before = world.positions[0].copy()
    start = reach(ROBOT, grasp_pose((0.62, -0.15, TABLE_Z + 0.15), 0.6), 0.085, REST)
    inside = reach(ROBOT, grasp_pose((0.77, -0.15, TABLE_Z + 0.15), 0.6), 0.085, start)
    robot.arm.follow(move(REST, start, 2.0))
    result = robot.arm.follow(move(start, inside, 1.0), ContactGuard(max_force_n=40.0, relief_m=0.005))
    assert result.stopped_by_contact
    assert not result.reached
    assert "anvil" in result.detail
    assert "gripper" in result.detail
    assert np.linalg.norm(world.positions[0] - before) < 0.005
    robot.wait_for_rest()
    force, _ = robot.arm._contacts.hardest(ignore_gripped=False)
    assert force < 5.0


@pytest.mark.parametrize("force_n", [20.0, 50.0])
def test_pads_press_with_the_force_that_was_asked_for(world, force_n):
    """Whatever the width: the motor's lever on the pads differs by half over the gripper's range."""
    robot, plan = SimulatedRobot(world), plan_for(world, 0)
    for trajectory in (plan.free, plan.approach):
        assert robot.arm.follow(trajectory).reached
    state = robot.gripper.close(force_n)
    assert state.holding
    pads = [world.model.geom(name).id for side in ROBOT.pad_geom_names for name in side]
    contact = world.data.contact
    on_pads = np.isin(contact.geom, pads).any(axis=1)
    total_n = world.data.efc_force[contact.efc_address[on_pads]].sum()
    assert total_n == pytest.approx(2 * force_n, rel=0.05)


def test_what_falls_off_before_the_first_pick_is_out_of_the_scene_and_nobody_dropped_it(world):
    robot = SimulatedRobot(world)
    world.set_object_pose(1, np.array([0.6, 0.8, TABLE_Z - 0.2]), np.array([1.0, 0, 0, 0]))
    assert robot.take_over() == (1,)
    assert world.presence.tolist() == [Presence.PRESENT, Presence.ABSENT]
    outcome = robot.execute(plan_for(world, 0))
    assert outcome.result is PickResult.RETRIEVED
    assert outcome.dropped == ()


def test_a_target_that_falls_off_before_the_first_pick_is_refused(world):
    robot = SimulatedRobot(world)
    world.set_object_pose(0, np.array([0.6, 0.8, TABLE_Z - 0.2]), np.array([1.0, 0, 0, 0]))
    with pytest.raises(InputError, match="falls off the table"):
        robot.take_over()

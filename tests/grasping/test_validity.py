"""Laws of validity and of who blocks whom."""

from dataclasses import replace

import numpy as np
import pytest
from grasping_scenes import TABLE_Z, WORKSPACE, standing_box

from torc.collision.collision_world import SURFACE, build_collision_world
from torc.collision.contacts import blockers
from torc.errors import InputError
from torc.grasping.geometric_planner import GENERATOR_NAMES, NO_GRASPS
from torc.grasping.hand_contacts import hand_contacts, open_boxes, voxel_blockers
from torc.grasping.validity import evaluate_grasps, evaluate_grasps_without_robot, tool0_targets
from torc.records import GraspSet, GraspStatus
from torc.robots.kinematics import tool0_poses
from torc.testing.views import view_of


def grasp_set(*grasps):
    """From (object id, T_world_tcp, width)."""
    n = len(grasps)
    return GraspSet(
        np.array([T for _, T, _ in grasps]).reshape(n, 4, 4),
        np.array([w for *_, w in grasps], dtype=float),
        np.linspace(1, 0.5, n),
        np.array([i for i, *_ in grasps], dtype=np.int16),
        np.zeros((n, 2, 3)),
        np.zeros(n, np.uint8),
        GENERATOR_NAMES,
    )


def pose(approach, closing, tip):
    T = np.eye(4)
    T[:3, 2], T[:3, 0], T[:3, 3] = approach, closing, tip
    T[:3, 1] = np.cross(approach, closing)
    return T


def tilted(x, y, z, tilt_deg=45.0, closing=(0, 1.0, 0)):
    """Approach in the x-z plane, tilted forward from straight down; closing along y."""
    a = np.deg2rad(tilt_deg)
    return pose(np.array([np.sin(a), 0, -np.cos(a)]), np.array(closing), (x, y, z))


def planned(planner, view):
    return planner.plan(view.scene, view.volume, np.random.default_rng(0))


@pytest.fixture(scope="module")
def report(planner, robot, pile):
    grasps = planned(planner, pile)
    return grasps, evaluate_grasps(grasps, pile.scene, pile.world, robot)


def test_counts_agree_with_the_rows(report, pile):
    grasps, r = report
    ids = list(r.object_ids)
    assert r.object_ids == pile.scene.ids
    for a, i in enumerate(ids):
        mine = grasps.object_ids == i
        assert r.valid_total[a] == np.count_nonzero(mine & (r.status == GraspStatus.VALID))
        assert r.blocked_total[a] == np.count_nonzero(mine & (r.blockers != 0))
        for b, j in enumerate(ids):
            assert r.blocking[a, b] == np.count_nonzero(
                mine & (r.blockers >> np.uint64(j) & np.uint64(1) != 0)
            )
    assert np.all(np.diag(r.blocking) == 0)
    assert set(r.graspable_ids) == {int(i) for i in grasps.object_ids[r.status == GraspStatus.VALID]}


def test_the_status_is_the_first_failing_check(report):
    _, r = report
    unreachable = np.isnan(r.qpos).any(axis=1)
    assert np.array_equal(r.status == GraspStatus.UNREACHABLE, unreachable)
    assert np.array_equal(r.status == GraspStatus.BLOCKED, ~unreachable & (r.blockers != 0))
    assert np.all(r.blockers[unreachable] == 0)
    assert np.count_nonzero(r.status == GraspStatus.VALID) > 10


def test_the_configurations_reach_the_grasps_within_limits(report, robot):
    grasps, r = report
    ok = ~np.isnan(r.qpos).any(axis=1)
    reached = tool0_poses(robot.arm, r.qpos[ok])
    assert np.allclose(reached, tool0_targets(grasps, robot.gripper)[ok], atol=1e-6)
    assert np.all((r.qpos[ok] >= robot.arm.lower - 1e-9) & (r.qpos[ok] <= robot.arm.upper + 1e-9))


def test_valid_means_no_contact_and_blocked_means_those_contacts(report, robot, pile):
    grasps, r = report
    ok = ~np.isnan(r.qpos).any(axis=1)
    own = grasps.object_ids[ok].astype(np.int64)
    touched = blockers(pile.world, robot, r.qpos[ok], robot.gripper.max_width_m, own)
    others = touched.bits & ~(np.uint64(1) << own.astype(np.uint64))
    assert np.array_equal(others, r.blockers[ok])
    assert np.all(touched.free[r.status[ok] == GraspStatus.VALID])


def test_flange_targets_undo_the_width_dependent_tool(gripper, rng):
    Ts = np.stack([tilted(0.6, y, 1.2) for y in (-0.2, 0.0, 0.1)])
    grasps = grasp_set(*[(0, T, w) for T, w in zip(Ts, (0.0, 0.0333, 0.085))])
    targets = tool0_targets(grasps, gripper)
    for T, tool0, w in zip(Ts, targets, grasps.widths_m):
        assert np.allclose(tool0 @ gripper.T_tool0_tcp(float(w)), T, atol=1e-6)


def test_a_tall_box_beside_a_low_one_blocks_it(planner, robot):
    """Pressed against a tall neighbour on either side, the low box can only be closed upon from the front."""
    view = view_of(
        standing_box(0, 0.62, -0.20, (0.05, 0.04, 0.06)),
        standing_box(3, 0.62, -0.255, (0.08, 0.06, 0.20)),
        standing_box(5, 0.62, -0.145, (0.08, 0.06, 0.20)),
    )
    across = grasp_set((0, tilted(0.62, -0.20, TABLE_Z + 0.03), 0.04))
    r = evaluate_grasps(across, view.scene, view.world, robot)
    assert GraspStatus(r.status[0]) == GraspStatus.BLOCKED
    assert int(r.blockers[0]) == (1 << 3) | (1 << 5)
    assert r.blocking.tolist() == [[0, 1, 1], [0, 0, 0], [0, 0, 0]]
    assert r.blocked_total.tolist() == [1, 0, 0]
    without = view_of(view.shapes[0])
    r = evaluate_grasps(across, without.scene, without.world, robot)
    assert GraspStatus(r.status[0]) == GraspStatus.VALID


def test_a_box_in_front_blocks_the_one_behind_by_what_it_hides(planner, robot):
    view = view_of(
        standing_box(1, 0.55, -0.20, (0.04, 0.20, 0.20)), standing_box(2, 0.66, -0.20, (0.05, 0.05, 0.21))
    )
    grasps = planned(planner, view)
    r = evaluate_grasps(grasps, view.scene, view.world, robot)
    low = (grasps.object_ids == 2) & (grasps.Ts_world_tcp[:, 2, 3] < TABLE_Z + 0.16)
    reachable = low & (r.status != GraspStatus.UNREACHABLE)
    assert np.all(r.status[reachable] == GraspStatus.BLOCKED)
    assert np.all(r.blockers[reachable] == 0b10)


def test_each_way_to_be_invalid(robot):
    view = view_of(
        standing_box(0, 0.60, -0.200, (0.05, 0.03, 0.10)), standing_box(1, 0.60, -0.170, (0.05, 0.02, 0.10))
    )
    z = TABLE_Z + 0.08
    cases = {
        GraspStatus.UNREACHABLE: (0, tilted(1.9, -0.2, z), 0.04),
        GraspStatus.HITS_STATIC: (0, tilted(0.60, 0.0, TABLE_Z - 0.01), 0.04),
        GraspStatus.SEVERAL_OBJECTS: (0, tilted(0.59, -0.1875, z), 0.06),
        GraspStatus.BLOCKED: (1, tilted(0.60, -0.165, z), 0.03),
    }
    r = evaluate_grasps(grasp_set(*cases.values()), view.scene, view.world, robot)
    assert [GraspStatus(s) for s in r.status] == list(cases)


def test_fingers_in_the_object_and_nothing_between_them(robot):
    view = view_of(standing_box(0, 0.62, -0.20, (0.05, 0.04, 0.10)))
    z = TABLE_Z + 0.075
    inside = tilted(0.62, -0.20 + 0.049, z)
    aside = tilted(0.62, -0.05, z)
    r = evaluate_grasps(grasp_set((0, inside, 0.085), (0, aside, 0.04)), view.scene, view.world, robot)
    assert GraspStatus(r.status[0]) == GraspStatus.FINGERS_IN_OBJECT
    assert GraspStatus(r.status[1]) == GraspStatus.SEVERAL_OBJECTS


def test_blocked_comes_before_all_later_reasons(robot):
    """Fingers in the own object and a neighbour in the way: BLOCKED."""
    view = view_of(
        standing_box(0, 0.62, -0.20, (0.05, 0.04, 0.10)), standing_box(1, 0.62, -0.10, (0.05, 0.03, 0.10))
    )
    grasp = grasp_set((0, tilted(0.62, -0.151, TABLE_Z + 0.075), 0.085))
    r = evaluate_grasps(grasp, view.scene, view.world, robot)
    assert GraspStatus(r.status[0]) == GraspStatus.BLOCKED


def test_without_a_robot_every_grasp_counts_as_reachable(planner, gripper, pile):
    grasps = planned(planner, pile)
    r = evaluate_grasps_without_robot(grasps, pile.scene, pile.world, gripper)
    assert r.qpos.shape == (len(grasps), 0)
    assert not np.any(r.status == GraspStatus.UNREACHABLE)
    assert np.array_equal(r.status == GraspStatus.BLOCKED, r.blockers != 0)


def test_what_is_valid_with_the_robot_is_almost_always_valid_without(report, gripper, pile):
    grasps, r = report
    alone = evaluate_grasps_without_robot(grasps, pile.scene, pile.world, gripper)
    valid = r.status == GraspStatus.VALID
    assert np.mean(alone.status[valid] == GraspStatus.VALID) > 0.9


def test_hand_contacts_against_every_voxel(planner, hand, pile, gripper):
    grasps = planned(planner, pile)
    pick = np.random.default_rng(0).permutation(len(grasps))[:25]
    world = pile.world
    own = grasps.object_ids.astype(np.int64)
    bits = hand_contacts(grasps, world, hand)[0][pick]
    occupied = np.argwhere(world.kind != 0)
    centers = world.grid.origin + world.grid.voxel_size_m * (occupied + 0.5)
    owners = world.bits[tuple(occupied.T)]
    grow = world.config.gripper_padding_m + world.grid.voxel_size_m / 2
    for row, found in zip(pick, bits):
        T, w = grasps.Ts_world_tcp[row], float(grasps.widths_m[row])
        shift = gripper.T_tool0_tcp(gripper.max_width_m)[2, 3] - gripper.T_tool0_tcp(w)[2, 3]
        p = (centers - T[:3, 3]) @ T[:3, :3]
        touched = np.zeros(len(p), dtype=bool)
        for box in open_boxes(hand):
            touched |= np.all(np.abs(p - box[:3] - [0, 0, shift]) <= box[3:] + grow, axis=1)
        touched &= owners & np.uint64(1 << int(own[row])) == 0
        assert int(found) == int(np.bitwise_or.reduce(owners[touched], initial=np.uint64(0)))


def test_voxel_blockers_are_the_hand_contacts_without_padding(planner, hand, pile):
    grasps = planned(planner, pile)
    bits = voxel_blockers(grasps, pile.volume, hand)
    world = build_collision_world(pile.volume, WORKSPACE)
    world = replace(world, config=replace(world.config, gripper_padding_m=0.0))
    expected, _ = hand_contacts(grasps, world, hand)
    assert np.array_equal(bits, expected)
    assert np.any(world.kind == SURFACE)


def test_nothing_to_evaluate(robot, gripper, pile):
    for r in (
        evaluate_grasps(NO_GRASPS, pile.scene, pile.world, robot),
        evaluate_grasps_without_robot(NO_GRASPS, pile.scene, pile.world, gripper),
    ):
        assert len(r.status) == 0
        assert not r.blocking.any()
        assert r.graspable_ids == ()


def test_grasps_for_objects_that_are_not_there_are_refused(robot, pile):
    with pytest.raises(InputError, match="60"):
        evaluate_grasps(grasp_set((60, tilted(0.6, 0, 1.2), 0.04)), pile.scene, pile.world, robot)

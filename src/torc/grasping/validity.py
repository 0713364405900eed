"""Which grasps are valid, and who blocks whom (paper: Grasping)."""

import numpy as np
from jaxtyping import Bool, Float, Int64, UInt64

from torc.collision.checks import blockers, robot_arrays
from torc.collision.world import CollisionWorld
from torc.errors import InputError
from torc.geometry.transforms import invert
from torc.grasping.config import ValidityConfig
from torc.grasping.hand import hand_geometry
from torc.grasping.hand_contacts import hand_contacts
from torc.grasping.hold import between_and_inside
from torc.records import GraspReport, GraspSet, GraspStatus, SegmentedScene
from torc.robots.description import GripperDescription, RobotDescription
from torc.robots.ik import solve_ik


def evaluate_grasps(
    grasps: GraspSet,
    scene: SegmentedScene,
    world: CollisionWorld,
    robot: RobotDescription,
    config: ValidityConfig | None = None,
) -> GraspReport:
    """Reach, collisions and grip of every grasp, with the gripper fully open.

    Of the inverse-kinematics solutions one without contacts is taken, the first in the solver's order; else one
    that touches nothing fixed and the fewest other objects; else the one with the fewest other objects.
    An arm link on the object to be grasped counts as fixed: no other pick would change it.

    Raises InputError if a grasp is for an object that is not in the scene.
    """
    config = ValidityConfig() if config is None else config
    _check_ids(grasps, scene)
    qpos, reachable, bits, fixed = _best_branches(grasps, world, robot, config)
    return _report(grasps, scene, robot.gripper, qpos, reachable, bits, fixed, config)


def evaluate_grasps_without_robot(
    grasps: GraspSet,
    scene: SegmentedScene,
    world: CollisionWorld,
    gripper: GripperDescription,
    config: ValidityConfig | None = None,
) -> GraspReport:
    """The same for the gripper alone: every grasp counts as reachable, and qpos has no columns."""
    config = ValidityConfig() if config is None else config
    _check_ids(grasps, scene)
    bits, fixed = hand_contacts(
        grasps.Ts_world_tcp, grasps.widths_m, grasps.object_ids.astype(np.int64), world, hand_geometry(gripper)
    )
    reachable = np.ones(len(grasps), dtype=bool)
    return _report(grasps, scene, gripper, np.zeros((len(grasps), 0)), reachable, bits, fixed, config)


def tool0_targets(grasps: GraspSet, gripper: GripperDescription) -> Float[np.ndarray, "n 4 4"]:
    """Pose of the flange at each grasp: T_world_tcp with the pads at the grasp's width."""
    if len(grasps) == 0:
        return np.zeros((0, 4, 4))
    Ts_tcp_tool0 = invert(np.stack([gripper.T_tool0_tcp(float(w)) for w in grasps.widths_m]))
    return grasps.Ts_world_tcp @ Ts_tcp_tool0


def _check_ids(grasps: GraspSet, scene: SegmentedScene) -> None:
    unknown = sorted(set(grasps.object_ids.tolist()) - set(scene.ids))
    if unknown:
        raise InputError(f"Grasps for objects {unknown}, but the scene shows only {list(scene.ids)}.")


def _best_branches(
    grasps: GraspSet, world: CollisionWorld, robot: RobotDescription, config: ValidityConfig
) -> tuple[np.ndarray, Bool[np.ndarray, "n"], UInt64[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Configuration, whether there is one, other objects touched there, and whether anything fixed is."""
    n, dof = len(grasps), robot.arm.dof
    qpos, bits, fixed = np.full((n, dof), np.nan), np.zeros(n, np.uint64), np.zeros(n, dtype=bool)
    if n == 0:
        return qpos, np.zeros(0, dtype=bool), bits, fixed
    solutions = solve_ik(robot.arm, tool0_targets(grasps, robot.gripper))
    count = np.minimum(solutions.count, config.max_branches)
    own = grasps.object_ids.astype(np.int64)
    best = np.full(n, np.iinfo(np.int64).max)
    arrays = robot_arrays(robot)
    rounds = [0, *[r for r in config.branch_rounds if r < config.max_branches], config.max_branches]
    for first, last in zip(rounds[:-1], rounds[1:]):
        # Only grasps without a free branch so far go on to the next round.
        grasp, branch = _pairs(np.where(best > 0, np.minimum(count, last), 0), first)
        if len(grasp) == 0:
            continue
        q = solutions.qpos[grasp, branch]
        touched = blockers(world, arrays, q, robot.gripper.max_width_m, own[grasp])
        own_bit = np.uint64(1) << own[grasp].astype(np.uint64)
        others = touched.bits & ~own_bit
        stuck = touched.static | touched.self_collision | ((touched.bits & own_bit) != 0)
        cost = (stuck * 64 + np.bitwise_count(others)).astype(np.int64) * 1024 + branch
        cost[(others == 0) & ~stuck] = 0
        # The cheapest of each grasp: written last.
        order = np.lexsort((branch, cost, grasp))[::-1]
        order = order[np.flatnonzero(np.concatenate([grasp[order][1:] != grasp[order][:-1], [True]]))]
        better = order[cost[order] < best[grasp[order]]]
        i = grasp[better]
        best[i], qpos[i], bits[i], fixed[i] = cost[better], q[better], others[better], stuck[better]
    return qpos, solutions.count > 0, bits, fixed


def _pairs(counts: Int64[np.ndarray, "n"], first: int) -> tuple[np.ndarray, np.ndarray]:
    """All (grasp, branch) with first <= branch < counts[grasp]."""
    many = np.maximum(counts - first, 0)
    grasp = np.repeat(np.arange(len(counts)), many)
    start = np.concatenate([[0], np.cumsum(many)[:-1]])
    return grasp, first + np.arange(many.sum()) - np.repeat(start, many)


def _report(
    grasps: GraspSet,
    scene: SegmentedScene,
    gripper: GripperDescription,
    qpos: np.ndarray,
    reachable: Bool[np.ndarray, "n"],
    bits: UInt64[np.ndarray, "n"],
    fixed: Bool[np.ndarray, "n"],
    config: ValidityConfig,
) -> GraspReport:
    """Status by the first failing check, and the counts between objects."""
    alone, in_object = between_and_inside(grasps, scene, gripper, config)
    failed = [
        (GraspStatus.UNREACHABLE, ~reachable),
        (GraspStatus.BLOCKED, bits != 0),
        (GraspStatus.HITS_STATIC, fixed),
        (GraspStatus.SEVERAL_OBJECTS, ~alone),
        (GraspStatus.FINGERS_IN_OBJECT, in_object),
    ]
    status = np.select([f for _, f in failed], [s.value for s, _ in failed], GraspStatus.VALID.value)
    ids = np.array(scene.ids, dtype=np.int64)
    owner = np.searchsorted(ids, grasps.object_ids.astype(np.int64))
    touched = (bits[:, None] >> ids.astype(np.uint64)) & np.uint64(1) != 0
    blocking = np.zeros((len(ids), len(ids)), dtype=np.int32)
    np.add.at(blocking, owner, touched.astype(np.int32))
    return GraspReport(
        status=status.astype(np.uint8),
        qpos=qpos,
        blockers=bits,
        object_ids=scene.ids,
        blocking=blocking,
        blocked_total=np.bincount(owner, touched.any(axis=1), len(ids)).astype(np.int32),
        valid_total=np.bincount(owner, status == GraspStatus.VALID, len(ids)).astype(np.int32),
    )

"""Find which grasps are valid, and who blocks whom (paper: Grasping)."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int64, UInt64
from numba import njit

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import blockers, collides, robot_arrays
from torc.collision.placement import RobotArrays
from torc.errors import InputError
from torc.geometry.transforms import invert, kernel_array
from torc.grasping.cells import gather
from torc.grasping.clouds import scene_cells
from torc.grasping.config import ValidityConfig
from torc.grasping.hand import between_pads, hand_geometry, reach_at
from torc.grasping.hand_contacts import hand_contacts
from torc.parallel import by_rows
from torc.records import GraspReport, GraspSet, GraspStatus, SegmentedScene
from torc.robots.description import RobotDescription
from torc.robots.gripper import GripperDescription
from torc.robots.ik import solve_ik

_Found = tuple[
    Float[np.ndarray, "n dof"], Bool[np.ndarray, "n"], UInt64[np.ndarray, "n"], Bool[np.ndarray, "n"]
]
"""Per grasp: a configuration, whether there is one, other objects touched there, and whether anything fixed is."""


def evaluate_grasps(
    grasps: GraspSet,
    scene: SegmentedScene,
    world: CollisionWorld,
    robot: RobotDescription,
    config: ValidityConfig | None = None,
) -> GraspReport:
    """Check reach, collisions and grip of every grasp, with the gripper fully open.

    Of the inverse-kinematics solutions the first without contacts is taken. Otherwise, of some spread over all
    solutions, it is one that touches nothing fixed and the fewest other objects; else the one with the fewest of them.
    An arm link on the object to be grasped counts as fixed: no other pick would change it. Raises InputError if a grasp
    is for an object that is not in the scene.
    """
    config = ValidityConfig() if config is None else config
    _check_ids(grasps, scene)
    return _report(grasps, scene, robot.gripper, _best_branches(grasps, world, robot, config), config)


def evaluate_grasps_without_robot(
    grasps: GraspSet,
    scene: SegmentedScene,
    world: CollisionWorld,
    gripper: GripperDescription,
    config: ValidityConfig | None = None,
) -> GraspReport:
    """Run `evaluate_grasps` for the gripper alone: every grasp counts as reachable, and qpos has no columns."""
    config = ValidityConfig() if config is None else config
    _check_ids(grasps, scene)
    touched = hand_contacts(grasps, world, hand_geometry(gripper))
    found = np.zeros((len(grasps), 0)), np.ones(len(grasps), dtype=bool), *touched
    return _report(grasps, scene, gripper, found, config)


def tool0_targets(grasps: GraspSet, gripper: GripperDescription) -> Float[np.ndarray, "n 4 4"]:
    """Return the pose of the flange at each grasp: T_world_tcp with the pads at the grasp's width."""
    widths_m = np.clip(grasps.widths_m, 0.0, gripper.max_width_m)
    return grasps.Ts_world_tcp @ invert(gripper.Ts_tool0_tcp_at(widths_m))


def _check_ids(grasps: GraspSet, scene: SegmentedScene) -> None:
    unknown = sorted(set(grasps.object_ids.tolist()) - set(scene.ids))
    if unknown:
        raise InputError(f"Grasps for objects {unknown}, but the scene shows only {list(scene.ids)}.")


def _best_branches(
    grasps: GraspSet, world: CollisionWorld, robot: RobotDescription, config: ValidityConfig
) -> _Found:
    """Find the branches that touch nothing, or else the least; see `evaluate_grasps`."""
    n, dof = len(grasps), robot.arm.dof
    qpos, bits, fixed = np.full((n, dof), np.nan), np.zeros(n, np.uint64), np.zeros(n, dtype=bool)
    if n == 0:
        return qpos, np.zeros(0, dtype=bool), bits, fixed
    own = grasps.object_ids.astype(np.int64)
    # If the gripper itself is blocked, no elbow position helps: these grasps get one try.
    hand_bits, hand_fixed = hand_contacts(grasps, world, hand_geometry(robot.gripper))
    hopeful = (hand_bits == 0) & ~hand_fixed
    solutions = solve_ik(robot.arm, tool0_targets(grasps, robot.gripper))
    arrays, width = robot_arrays(robot), robot.gripper.max_width_m
    search = _Search(world, arrays, width, own, solutions.qpos, solutions.count)
    free = search.first_free(np.where(hopeful, config.max_branches, 1), config.branch_rounds)
    found = np.flatnonzero(free >= 0)
    qpos[found] = solutions.qpos[found, free[found]]
    held_up = np.flatnonzero((free < 0) & (solutions.count > 0))
    most = np.where(hopeful[held_up], config.blocked_branches, 1 + config.blocked_branches // 4)
    branch, bits[held_up], fixed[held_up] = search.least_blocked(held_up, most)
    qpos[held_up] = solutions.qpos[held_up, branch]
    return qpos, solutions.count > 0, bits, fixed


@dataclass(frozen=True)
class _Search:
    """Inverse-kinematics branches of grasps, and what to check them against."""

    world: CollisionWorld
    arrays: RobotArrays
    width_m: float
    own: Int64[np.ndarray, "n"]
    qpos: Float[np.ndarray, "n b dof"]
    count: Int64[np.ndarray, "n"]

    def first_free(self, most: Int64[np.ndarray, "n"], rounds: tuple[int, ...]) -> Int64[np.ndarray, "n"]:
        """Return the first branch of each grasp that touches nothing, among its `most` first; -1 if there is none."""
        out = np.full(len(self.own), -1)
        bounds = [0, *rounds, int(most.max(initial=0))]
        for first, last in pairwise(bounds):
            open_ones = np.where(out < 0, np.minimum(np.minimum(self.count, most), last), 0)
            grasp, branch = _pairs(open_ones, first)
            if len(grasp) == 0:
                continue
            hit = collides(self.world, self.arrays, self.qpos[grasp, branch], self.width_m, self.own[grasp])
            # Backwards, so that the first free branch of a grasp is written last.
            good = np.flatnonzero(~hit)[::-1]
            out[grasp[good]] = branch[good]
        return out

    def least_blocked(
        self, index: np.ndarray, most: Int64[np.ndarray, "m"]
    ) -> tuple[Int64[np.ndarray, "m"], UInt64[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        """Return the branch of each grasp in `index` that touches the least, of `most` spread over all of them.

        Nothing fixed ranks before fewest other objects, which rank before the solver's order. Also returns the other
        objects touched there, and whether anything fixed is.
        """
        taken = np.minimum(most, self.count[index])
        row, step = _pairs(taken, 0)
        branch = step * self.count[index][row] // np.maximum(taken[row], 1)
        own = self.own[index][row]
        touched = blockers(self.world, self.arrays, self.qpos[index[row], branch], self.width_m, own)
        own_bit = np.uint64(1) << own.astype(np.uint64)
        others = touched.bits & ~own_bit
        stuck = touched.static | touched.self_collision | ((touched.bits & own_bit) != 0)
        order = np.lexsort((branch, np.bitwise_count(others), stuck, row))
        first = order[np.flatnonzero(np.diff(row[order], prepend=-1))]
        return branch[first], others[first], stuck[first]


def _pairs(counts: Int64[np.ndarray, "n"], first: int) -> tuple[np.ndarray, np.ndarray]:
    """Return all (grasp, branch) with first <= branch < counts[grasp]."""
    many = np.maximum(counts - first, 0)
    grasp = np.repeat(np.arange(len(counts)), many)
    start = np.cumsum(many) - many
    return grasp, first + np.arange(many.sum()) - np.repeat(start, many)


def _report(
    grasps: GraspSet,
    scene: SegmentedScene,
    gripper: GripperDescription,
    found: _Found,
    config: ValidityConfig,
) -> GraspReport:
    """Return the report: status by the first failing check, and the counts between objects."""
    qpos, reachable, bits, fixed = found
    Ts, widths_m, own = kernel_array(grasps.Ts_world_tcp), kernel_array(grasps.widths_m), grasps.object_ids
    cells, hand = scene_cells(scene, config.clouds), hand_geometry(gripper)
    between, inside, foreign = np.zeros((3, len(grasps)), np.int64)
    by_rows(_count, (Ts, widths_m, kernel_array(own, np.int64), between, inside, foreign), cells, hand)
    failed = [
        (GraspStatus.UNREACHABLE, ~reachable),
        (GraspStatus.BLOCKED, bits != 0),
        (GraspStatus.HITS_STATIC, fixed),
        (GraspStatus.SEVERAL_OBJECTS, (between == 0) | (foreign > config.checks.max_foreign_between)),
        (GraspStatus.FINGERS_IN_OBJECT, inside > config.checks.max_own_in_fingers),
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


@njit(cache=True, nogil=True)
def _count(Ts, widths, own_ids, between, inside, foreign, cells, hand):
    """Count own points between and inside the fingers, and the most points between them that one other object has.

    Between: within the opening along x, within the pads along y, and from the pads' rear end in the open state to the
    closed fingertips along z. Inside: in a finger of the open gripper.
    """
    per_id = np.zeros(64, dtype=np.int64)
    local, index = np.empty((len(cells.points), 3)), np.empty(len(cells.points), dtype=np.int64)
    inner, outer = 0.5 * hand.max_width_m, 0.5 * hand.max_width_m + hand.finger_x
    for n in range(len(widths)):
        R, tip = Ts[n, :3, :3].copy(), Ts[n, :3, 3].copy()
        shift_z = -reach_at(hand.reach_m, widths[n])
        box = (outer, hand.finger_y, shift_z - hand.finger_z, 0.0)
        per_id[:] = 0
        for i in range(gather(R, tip, box, cells, local, index)):
            x, y, z, tag = abs(local[i, 0]), local[i, 1], local[i, 2], cells.tags[index[i]]
            if between_pads(x, y, z, inner, hand.pad_y, hand.pad_z):
                per_id[tag] += 1
            elif x >= inner and z <= shift_z and tag == own_ids[n]:
                inside[n] += 1
        between[n] = per_id[own_ids[n]]
        per_id[own_ids[n]] = 0
        foreign[n] = per_id.max()

"""Plan the straight motions of a pick, down to the grasp and up again: which branch can do both, and from where."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Bool, Float

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import Contacts, blockers, collides, self_contacts, static_contacts
from torc.geometry.transforms import Pose, invert
from torc.motion.holding import Held
from torc.motion.mover import Mover
from torc.motion.protocol import NoMotionError
from torc.records import PlanStage, Trajectory
from torc.robots.description import Qpos
from torc.robots.ik import solve_ik

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LineContext:
    """One grasp, and everything that its motions depend on.

    Attributes:
        own_id: the object to be grasped.
        grasp_width_m: distance between the pads of the closed gripper.
        held_in_world: returns the object as it is held, world frame, where it is now; called when first needed.
    """

    mover: Mover
    world: CollisionWorld
    own_id: int
    T_world_tcp: Pose
    grasp_width_m: float
    held_in_world: Callable[[], Held]

    @cached_property
    def width_m(self) -> float:
        """Opening of the closed gripper, within its range."""
        return float(np.clip(self.grasp_width_m, 0.0, self.mover.robot.gripper.max_width_m))

    @cached_property
    def T_world_tool0(self) -> Pose:
        """The flange at the grasp."""
        return self.T_world_tcp.astype(float) @ invert(self.mover.robot.gripper.T_tool0_tcp(self.width_m))

    @property
    def approach_axis(self) -> Float[np.ndarray, "3"]:
        """Direction of the approach, world frame."""
        return self.T_world_tcp[:3, 2].astype(float)

    @cached_property
    def held(self) -> Held:
        """The object once it is in the hand, in the tool0 frame."""
        return self.held_in_world().moved(invert(self.T_world_tool0))

    @cached_property
    def without_object(self) -> CollisionWorld:
        """The world once the object is in the hand, with what it hid as free."""
        return self.world.without_object(self.own_id)

    def contacts(self, qpos: Float[np.ndarray, "n dof"]) -> Contacts:
        """Return the contacts, leaving out the object to be grasped."""
        return blockers(self.world, self.mover.arrays, qpos, self.mover.opening_m, self.own_id)

    def free_when_lifted(self, qpos: Float[np.ndarray, "n dof"]) -> Bool[np.ndarray, "n"]:
        """Check whether nothing is touched with the object in the hand, however far it may reach."""
        held = self.held.possible
        return ~collides(self.without_object, self.mover.arrays, qpos, self.width_m, attached=held)

    def hits_fixed(self, qpos: Float[np.ndarray, "n dof"]) -> bool:
        """Check whether table, bin or the robot itself is touched anywhere."""
        return bool(np.any(static_contacts(self.world, self.mover.arrays, qpos, self.mover.opening_m)))

    def hits_robot_when_held(self, qpos: Float[np.ndarray, "n dof"]) -> bool:
        """Check whether the visible part of the object in the hand touches the robot anywhere."""
        held = self.held.seen
        return bool(np.any(self_contacts(self.world, self.mover.arrays, qpos, self.width_m, held)))


@dataclass(frozen=True)
class LinePair:
    """The path from pre-grasp to grasp, and the one from there up, of one inverse-kinematics branch; ends included."""

    approach: Float[np.ndarray, "m dof"]
    lift: Float[np.ndarray, "k dof"]


def line_candidates(context: LineContext, qpos_reported: Qpos, qpos_start: Qpos) -> list[LinePair]:
    """Return approaches and lifts, best first. Raises NoMotionError if none has a free pre-grasp.

    A line must keep off table, bin and the robot itself, with the object in the hand too. Lines may touch other objects
    (paper: A Modular Pipeline), but the branches that touch least of them come first; then long approaches, then
    nearness to the start. `qpos_reported`: the grasp report's own solution, tried first; not finite if it has none.
    """
    branches, config = _branches(context, qpos_reported), context.mover.config.cartesian
    blocked = False
    for i in range(config.max_rounds):
        some = branches[i * config.max_branches : (i + 1) * config.max_branches]
        pairs = _line_pairs(context, some, qpos_start)
        if free := [pair for pair, is_free in pairs if is_free]:
            return free
        blocked = blocked or len(pairs) > 0
    why = "no pre-grasp is free" if blocked else "no straight approach and lift within reach"
    raise NoMotionError(PlanStage.APPROACH, f"{why}.")


def timed_lines(mover: Mover, pair: LinePair) -> tuple[Trajectory, Trajectory]:
    """Return approach and lift as trajectories."""
    config = mover.config.cartesian
    return (
        mover.timed_line(pair.approach, max(config.back_offs_m), config.approach_speed_m_s),
        mover.timed_line(pair.lift, max(config.lifts_m), config.lift_speed_m_s),
    )


_Branches = Float[np.ndarray, "b dof"]
"""Inverse-kinematics solutions of a grasp."""


def _branches(context: LineContext, qpos_reported: np.ndarray) -> _Branches:
    """Return free inverse-kinematics solutions of the grasp, the reported one first."""
    solutions = solve_ik(context.mover.arm, context.T_world_tool0[None]).of(0)
    if np.all(np.isfinite(qpos_reported)):
        solutions = np.vstack([qpos_reported, solutions])
    if len(solutions) == 0:
        raise NoMotionError(PlanStage.INVERSE_KINEMATICS, "out of reach.")
    free = context.contacts(solutions).free
    if not free.any():
        raise NoMotionError(PlanStage.INVERSE_KINEMATICS, "the arm touches something in every solution.")
    return solutions[free]


def _line_pairs(context: LineContext, branches: _Branches, qpos_start: Qpos) -> list[tuple[LinePair, bool]]:
    """Return, per branch, lines that it can follow, and whether their pre-grasp is free; the best ones first."""
    mover, config = context.mover, context.mover.config.cartesian
    ranked = []
    upward, up_count = mover.follow(branches, context.T_world_tool0, _UP, max(config.lifts_m))
    raisable = np.flatnonzero(up_count >= min(mover.line_counts(config.lifts_m)))
    for b, path, count in zip(raisable, *_backward(context, branches[raisable])):
        q = branches[b]
        back = _pre_grasp(context, q, path, int(count))
        up = None if back is None else _lift(context, q, upward[b], int(up_count[b]))
        if back is None or up is None:
            continue
        pair = LinePair(np.vstack([path[: back[0]][::-1], q]), np.vstack([q, upward[b, : up[0]]]))
        # Every second waypoint is checked.
        touched = int(np.count_nonzero(~context.contacts(pair.approach[::-2]).free)) + (not up[1])
        distance = float(np.max(np.abs(pair.approach[0] - qpos_start) / mover.arm.max_speed))
        ranked.append(((touched, -len(pair.approach), distance), pair, back[1]))
    return [(pair, free) for _, pair, free in sorted(ranked, key=lambda item: item[0])]


def _backward(context: LineContext, branches: _Branches) -> tuple[np.ndarray, np.ndarray]:
    """Follow the line from the grasp to the farthest pre-grasp."""
    longest_m = max(context.mover.config.cartesian.back_offs_m)
    return context.mover.follow(branches, context.T_world_tool0, -context.approach_axis, longest_m)


_End = tuple[int, bool] | None
"""Number of waypoints of a line, and whether its end touches nothing; None if there is no line."""


def _pre_grasp(context: LineContext, q_grasp: np.ndarray, backward: np.ndarray, reached: int) -> _End:
    """Return where the approach begins: the first length that hits nothing fixed, those with a free end first."""
    counts = context.mover.line_counts(context.mover.config.cartesian.back_offs_m)
    path = np.vstack([q_grasp, backward[:reached]])
    return _first(counts, path, lambda q: context.contacts(q).free, lambda q: not context.hits_fixed(q))


def _lift(context: LineContext, q_grasp: np.ndarray, upward: np.ndarray, reached: int) -> _End:
    """Return where the lift ends: the first possible length, those with a free end first, then the longest."""
    counts = context.mover.line_counts(context.mover.config.cartesian.lifts_m)
    path = np.vstack([q_grasp, upward[:reached]])
    return _first(counts, path, context.free_when_lifted, partial(_can_lift, context), longest_first=True)


def _first(
    counts: list[int],
    path: Float[np.ndarray, "m dof"],
    free_at: Callable[[np.ndarray], np.ndarray],
    possible: Callable[[np.ndarray], bool],
    longest_first: bool = False,
) -> _End:
    counts = [c for c in counts if c < len(path)]
    if not counts:
        return None
    free = free_at(path[counts])
    blocked = sorted((c for c, f in zip(counts, free) if not f), reverse=longest_first)
    for count, is_free in [(c, True) for c, f in zip(counts, free) if f] + [(c, False) for c in blocked]:
        if possible(path[: count + 1 : 2]):
            return count, is_free
    return None


def _can_lift(context: LineContext, path: Float[np.ndarray, "m dof"]) -> bool:
    """Check whether a lift keeps off everything fixed, and the object in the hand off the robot."""
    return not context.hits_fixed(path) and not context.hits_robot_when_held(path)

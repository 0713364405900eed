"""Approach and lift: which inverse-kinematics branch can do both, and from where."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.collision.checks import Contacts, blockers, static_contacts
from torc.collision.placement import RobotArrays
from torc.collision.world import CollisionWorld
from torc.motion.config import CartesianConfig
from torc.motion.following import follow_line, line_poses
from torc.robots.description import ArmDescription
from torc.robots.kinematics import tool0_poses

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LinePair:
    """Approach and lift of one inverse-kinematics branch.

    Attributes:
        approach: from pre-grasp to grasp, both included.
        approach_poses: pose of the flange at each of its waypoints.
        lift: from grasp to the raised position, both included.
        lift_poses: pose of the flange at each of its waypoints.
        touches: waypoints of both at which something else is touched.
    """

    approach: Float[np.ndarray, "m dof"]
    approach_poses: Float[np.ndarray, "m 4 4"]
    lift: Float[np.ndarray, "k dof"]
    lift_poses: Float[np.ndarray, "k 4 4"]
    touches: int


@dataclass(frozen=True)
class LineContext:
    """What the lines of one grasp depend on.

    Attributes:
        arm, robot: the arm, and the robot for the compiled checks.
        world: obstacles.
        opening_m: of the gripper.
        own_id: the object to be grasped.
    """

    arm: ArmDescription
    robot: RobotArrays
    world: CollisionWorld
    opening_m: float
    own_id: int

    def contacts(self, qpos: Float[np.ndarray, "n dof"]) -> Contacts:
        """What is touched, the object to be grasped left out."""
        return blockers(self.world, self.robot, qpos, self.opening_m, self.own_id)

    def hits_fixed(self, qpos: Float[np.ndarray, "n dof"]) -> bool:
        """Whether table, bin or the robot itself is touched anywhere."""
        return bool(np.any(static_contacts(self.world, self.robot, qpos, self.opening_m)))


def line_pairs(
    context: LineContext,
    T_world_tool0: Float[np.ndarray, "4 4"],
    approach_axis: Float[np.ndarray, "3"],
    branches: Float[np.ndarray, "b dof"],
    qpos_start: Float[np.ndarray, "dof"],
    config: CartesianConfig,
) -> tuple[list[LinePair], list[LinePair]]:
    """Per branch the longest approach and lift that it can follow; those with a free pre-grasp, and the
    others.

    A line must keep off table, bin and the robot itself. Other objects are not forbidden on lines (paper: A
    Modular Pipeline), but the branches that touch least of them come first; then long approaches, then
    nearness to the start.
    """
    margin = config.limit_margin_rad
    lower, upper = context.arm.lower + margin, context.arm.upper - margin
    back = line_poses(T_world_tool0, -approach_axis, max(config.back_offs_m), config.step_m)
    up = line_poses(T_world_tool0, _UP, max(config.lifts_m), config.step_m)
    step = config.max_joint_step_rad
    backward, back_count = follow_line(context.robot, branches, back, lower, upper, step)
    upward, up_count = follow_line(context.robot, branches, up, lower, upper, step)
    ranked: list[tuple[tuple[float, ...], LinePair]] = []
    blocked: list[tuple[tuple[float, ...], LinePair]] = []
    for b, q in enumerate(branches):
        raised = _longest(config.lifts_m, config.step_m, max(config.lifts_m), int(up_count[b]))
        lift = np.vstack([q, upward[b, :raised]])
        if raised == 0 or context.hits_fixed(lift[::2]):
            continue
        found = _pre_grasp(context, q, backward[b], int(back_count[b]), config)
        if found is None:
            continue
        n, free = found
        approach = np.vstack([backward[b, :n][::-1], q])
        touches = _touches(context, approach) + _touches(context, lift[-1:])
        pair = LinePair(
            approach,
            np.concatenate([back[:n][::-1], T_world_tool0[None]]),
            lift,
            np.concatenate([T_world_tool0[None], up[:raised]]),
            touches,
        )
        distance = float(np.max(np.abs(approach[0] - qpos_start) / context.arm.max_speed))
        (ranked if free else blocked).append(((touches, -n, distance), pair))
    ranked.sort(key=lambda item: item[0])
    blocked.sort(key=lambda item: item[0])
    return [pair for _, pair in ranked], [pair for _, pair in blocked]


def line_error(
    arm: ArmDescription, path: Float[np.ndarray, "m dof"], poses: Float[np.ndarray, "m 4 4"]
) -> tuple[float, float]:
    """Largest distance (metres) and turn (radians) between the flange along a path and where it should be."""
    actual = tool0_poses(arm, path)
    distance = np.linalg.norm(actual[:, :3, 3] - poses[:, :3, 3], axis=1)
    # |R1 - R2| (Frobenius) = 2 sqrt(2) sin(turn / 2); the trace formula loses small angles to rounding.
    chord = np.linalg.norm(actual[:, :3, :3] - poses[:, :3, :3], axis=(1, 2)) / (2 * np.sqrt(2))
    return float(distance.max()), float(2 * np.arcsin(np.minimum(chord, 1.0)).max())


def line_fault(
    arm: ArmDescription,
    path: Float[np.ndarray, "m dof"],
    poses: Float[np.ndarray, "m 4 4"],
    config: CartesianConfig,
) -> str | None:
    """What is wrong with a joint path along given poses, or None: off the line, a jump, a limit."""
    if not np.all(np.isfinite(path)):
        return "not finite"
    if np.any(path < arm.lower) or np.any(path > arm.upper):
        return "beyond a joint limit"
    if np.any(np.abs(np.diff(path, axis=0)) > config.max_joint_step_rad):
        return "a jump of a joint"
    distance, turn = line_error(arm, path, poses)
    if distance > config.max_deviation_m or turn > config.max_turn_rad:
        return f"{1e3 * distance:.1f} mm and {turn:.3f} rad off the line"
    return None


def _longest(lengths_m: tuple[float, ...], step_m: float, total_m: float, reached: int) -> int:
    """Number of waypoints of the longest permitted length among those reached; 0 if there is none."""
    n = max(1, int(np.ceil(total_m / step_m - 1e-9)))
    for length in sorted(lengths_m, reverse=True):
        count = round(length / total_m * n)
        if count <= reached:
            return count
    return 0


def _pre_grasp(
    context: LineContext,
    q_grasp: Float[np.ndarray, "dof"],
    backward: Float[np.ndarray, "m dof"],
    reached: int,
    config: CartesianConfig,
) -> tuple[int, bool] | None:
    """Number of waypoints back to the pre-grasp, and whether it is free; None if the line hits something fixed."""
    total = max(config.back_offs_m)
    n = len(backward)
    counts = [c for c in (round(d / total * n) for d in config.back_offs_m) if c <= reached]
    if not counts:
        return None
    free = context.contacts(backward[[c - 1 for c in counts]]).free
    best = int(np.argmax(free)) if free.any() else len(counts) - 1
    line = np.vstack([q_grasp, backward[: counts[best]]])
    return None if context.hits_fixed(line[::2]) else (counts[best], bool(free[best]))


def _touches(context: LineContext, path: Float[np.ndarray, "m dof"]) -> int:
    """Waypoints (every second one) at which something else is touched."""
    return int(np.count_nonzero(~context.contacts(path[::-2]).free))

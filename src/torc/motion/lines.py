"""Approach and lift: which inverse-kinematics branch can do both, and from where."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from torc.motion.config import CartesianConfig
from torc.motion.following import follow_line, line_poses
from torc.motion.line_context import LineContext

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LinePair:
    """Approach and lift of one inverse-kinematics branch.

    Attributes:
        approach: from pre-grasp to grasp, both included.
        lift: from grasp to the raised position, both included.
    """

    approach: Float[np.ndarray, "m dof"]
    lift: Float[np.ndarray, "k dof"]


def line_pairs(
    context: LineContext,
    branches: Float[np.ndarray, "b dof"],
    qpos_start: Float[np.ndarray, "dof"],
    config: CartesianConfig,
) -> tuple[list[LinePair], list[LinePair]]:
    """Per branch an approach and a lift that it can follow; those with a free pre-grasp, and the others.

    A line must keep off table, bin and the robot itself, with the object in the hand too. Other objects are not
    forbidden on lines (paper: A Modular Pipeline), but the branches that touch least of them come first; then long
    approaches, then nearness to the start.
    """
    ranked: list[tuple[tuple[float, ...], LinePair]] = []
    blocked: list[tuple[tuple[float, ...], LinePair]] = []
    for lines in _branch_lines(context, branches, config):
        approach = lines.pair.approach
        touches = _touches(context, approach) + (not lines.clear)
        distance = float(np.max(np.abs(approach[0] - qpos_start) / context.arm.max_speed))
        (ranked if lines.free else blocked).append(((touches, -len(approach), distance), lines.pair))
    ranked.sort(key=lambda item: item[0])
    blocked.sort(key=lambda item: item[0])
    return [pair for _, pair in ranked], [pair for _, pair in blocked]


def has_lines(context: LineContext, branches: Float[np.ndarray, "b dof"], config: CartesianConfig) -> bool:
    """Whether `line_pairs` finds any with a free pre-grasp."""
    up = _upward(context, config)
    # A longer lift begins with the shortest one.
    up = up[: min(line_counts(config.lifts_m, len(up)))]
    upward, up_count = _follow(context, branches, up, config)
    raisable = np.flatnonzero(up_count == len(up))
    backward, back_count = _follow(context, branches[raisable], _backward(context, config), config)
    for b, path, count in zip(raisable, backward, back_count):
        found = _pre_grasp(context, branches[b], path, int(count), config)
        if found is not None and found[1] and _can_lift(context, np.vstack([branches[b], upward[b]])):
            return True
    return False


@dataclass(frozen=True)
class _BranchLines:
    """The lines of one branch, whether its pre-grasp is free, and whether nothing is touched at the end of its lift."""

    pair: LinePair
    free: bool
    clear: bool


def _branch_lines(
    context: LineContext, branches: Float[np.ndarray, "b dof"], config: CartesianConfig
) -> Iterator[_BranchLines]:
    """The lines of each branch that has both, in the order of the branches; see `line_pairs`."""
    up = _upward(context, config)
    upward, up_count = _follow(context, branches, up, config)
    raisable = np.flatnonzero(up_count >= min(line_counts(config.lifts_m, len(up))))
    backward, back_count = _follow(context, branches[raisable], _backward(context, config), config)
    for b, path, count in zip(raisable, backward, back_count):
        q = branches[b]
        found = _pre_grasp(context, q, path, int(count), config)
        if found is None:
            continue
        raised = _lift(context, q, upward[b], int(up_count[b]), config)
        if raised is None:
            continue
        n, free = found
        n_up, clear = raised
        approach = np.vstack([path[:n][::-1], q])
        yield _BranchLines(LinePair(approach, np.vstack([q, upward[b, :n_up]])), free, clear)


def _backward(context: LineContext, config: CartesianConfig) -> Float[np.ndarray, "m 4 4"]:
    """The flange on its way from the grasp to the farthest pre-grasp."""
    return line_poses(context.T_world_tool0, -context.approach_axis, max(config.back_offs_m), config.step_m)


def _upward(context: LineContext, config: CartesianConfig) -> Float[np.ndarray, "m 4 4"]:
    """The flange on the highest lift."""
    return line_poses(context.T_world_tool0, _UP, max(config.lifts_m), config.step_m)


def _follow(
    context: LineContext,
    branches: Float[np.ndarray, "b dof"],
    poses: Float[np.ndarray, "m 4 4"],
    config: CartesianConfig,
) -> tuple[Float[np.ndarray, "b m dof"], Int[np.ndarray, "b"]]:
    """The path of each branch along the poses, and how many of them it reaches."""
    margin, step = config.limit_margin_rad, config.max_joint_step_rad
    lower, upper = context.arm.lower + margin, context.arm.upper - margin
    return follow_line(context.robot, branches, poses, lower, upper, step)


def _lift(
    context: LineContext,
    q_grasp: Float[np.ndarray, "dof"],
    upward: Float[np.ndarray, "m dof"],
    reached: int,
    config: CartesianConfig,
) -> tuple[int, bool] | None:
    """Number of waypoints of the lift, and whether nothing is touched at its end; None if there is no lift.

    Lifts with a free end come first, in the order of the settings; then the others, the highest first.
    """
    counts = [c for c in line_counts(config.lifts_m, len(upward)) if c <= reached]
    if not counts:
        return None
    free = context.free_when_lifted(upward[[c - 1 for c in counts]])
    order = [c for c, f in zip(counts, free) if f] + sorted(
        (c for c, f in zip(counts, free) if not f), reverse=True
    )
    for i, count in enumerate(order):
        if _can_lift(context, np.vstack([q_grasp, upward[:count]])):
            return count, i < int(np.count_nonzero(free))
    return None


def _can_lift(context: LineContext, lift: Float[np.ndarray, "m dof"]) -> bool:
    """Whether a lift keeps off everything fixed, and the object in the hand off the robot."""
    return not context.hits_fixed(lift[::2]) and not context.hits_robot_when_held(lift[::2])


def line_counts(lengths_m: tuple[float, ...], waypoints: int) -> list[int]:
    """Number of waypoints of each length, in the order given; the longest takes them all."""
    return [max(1, round(length / max(lengths_m) * waypoints)) for length in lengths_m]


def _pre_grasp(
    context: LineContext,
    q_grasp: Float[np.ndarray, "dof"],
    backward: Float[np.ndarray, "m dof"],
    reached: int,
    config: CartesianConfig,
) -> tuple[int, bool] | None:
    """Number of waypoints back to the pre-grasp, and whether it is free; None if every line hits something fixed.

    Free ones come first, in the order of the settings; then the others, the nearest first.
    """
    counts = [c for c in line_counts(config.back_offs_m, len(backward)) if c <= reached]
    if not counts:
        return None
    free = context.contacts(backward[[c - 1 for c in counts]]).free
    order = [c for c, f in zip(counts, free) if f] + sorted(c for c, f in zip(counts, free) if not f)
    for i, count in enumerate(order):
        if not context.hits_fixed(np.vstack([q_grasp, backward[:count]])[::2]):
            return count, i < int(np.count_nonzero(free))
    return None


def _touches(context: LineContext, path: Float[np.ndarray, "m dof"]) -> int:
    """Waypoints (every second one) at which something else is touched."""
    return int(np.count_nonzero(~context.contacts(path[::-2]).free))

"""Plan approach and lift: which inverse-kinematics branch can do both, and from where."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from torc.motion.config import CartesianConfig
from torc.motion.following import follow_lines, waypoints_of
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
    """Return, per branch, an approach and a lift that it can follow: those with a free pre-grasp, and the others.

    A line must keep off table, bin and the robot itself, with the object in the hand too. Lines may touch other objects
    (paper: A Modular Pipeline), but the branches that touch least of them come first; then long approaches, then
    nearness to the start.
    """
    ranked = []
    for pair, free, clear in _branch_lines(context, branches, config):
        # Every second waypoint is checked.
        touched = int(np.count_nonzero(~context.contacts(pair.approach[::-2]).free)) + (not clear)
        distance = float(np.max(np.abs(pair.approach[0] - qpos_start) / context.arm.max_speed))
        ranked.append(((touched, -len(pair.approach), distance), free, pair))
    ranked.sort(key=lambda item: item[0])
    return [pair for _, free, pair in ranked if free], [pair for _, free, pair in ranked if not free]


def has_lines(context: LineContext, branches: Float[np.ndarray, "b dof"], config: CartesianConfig) -> bool:
    """Check whether `line_pairs` finds any with a free pre-grasp."""
    # A longer lift begins with the shortest one.
    few = min(line_counts(config.lifts_m, config.step_m))
    upward, up_count = _upward(context, branches, config, few)
    raisable = np.flatnonzero(up_count == few)
    backward, back_count = _backward(context, branches[raisable], config)
    for b, path, count in zip(raisable, backward, back_count):
        found = _pre_grasp(context, branches[b], path, int(count), config)
        if found is not None and found[1] and _can_lift(context, np.vstack([branches[b], upward[b]])):
            return True
    return False


def _branch_lines(
    context: LineContext, branches: Float[np.ndarray, "b dof"], config: CartesianConfig
) -> Iterator[tuple[LinePair, bool, bool]]:
    """Yield the lines of each branch that has both, and whether its pre-grasp and the end of its lift are free."""
    upward, up_count = _upward(context, branches, config)
    raisable = np.flatnonzero(up_count >= min(line_counts(config.lifts_m, config.step_m)))
    backward, back_count = _backward(context, branches[raisable], config)
    for b, path, count in zip(raisable, backward, back_count):
        q = branches[b]
        found = _pre_grasp(context, q, path, int(count), config)
        if found is None:
            continue
        raised = _lift(context, q, upward[b], int(up_count[b]), config)
        if raised is None:
            continue
        (n, free), (n_up, clear) = found, raised
        pair = LinePair(np.vstack([path[:n][::-1], q]), np.vstack([q, upward[b, :n_up]]))
        yield pair, free, clear


_Paths = tuple[Float[np.ndarray, "b m dof"], Int[np.ndarray, "b"]]
"""The path of each branch along a line, and how many of its waypoints are reached."""


def _backward(context: LineContext, branches: Float[np.ndarray, "b dof"], config: CartesianConfig) -> _Paths:
    """Follow the line from the grasp to the farthest pre-grasp."""
    return _follow(context, branches, -context.approach_axis, max(config.back_offs_m), config)


def _upward(
    context: LineContext,
    branches: Float[np.ndarray, "b dof"],
    config: CartesianConfig,
    waypoints: int | None = None,
) -> _Paths:
    """Follow the line of the highest lift."""
    return _follow(context, branches, _UP, max(config.lifts_m), config, waypoints)


def _follow(
    context: LineContext,
    branches: Float[np.ndarray, "b dof"],
    direction: Float[np.ndarray, "3"],
    length_m: float,
    config: CartesianConfig,
    waypoints: int | None = None,
) -> _Paths:
    Ts = np.broadcast_to(context.T_world_tool0, (len(branches), 4, 4))
    directions = np.broadcast_to(direction, (len(branches), 3))
    return follow_lines(context.arm, context.robot, branches, Ts, directions, length_m, config, waypoints)


def _lift(
    context: LineContext,
    q_grasp: Float[np.ndarray, "dof"],
    upward: Float[np.ndarray, "m dof"],
    reached: int,
    config: CartesianConfig,
) -> tuple[int, bool] | None:
    """Return the number of waypoints of the lift, and whether its end touches nothing; None if there is no lift."""
    counts = [c for c in line_counts(config.lifts_m, config.step_m) if c <= reached]
    if not counts:
        return None
    free = context.free_when_lifted(upward[[c - 1 for c in counts]])

    def possible(count: int) -> bool:
        return _can_lift(context, np.vstack([q_grasp, upward[:count]]))

    return _first(counts, free, True, possible)


def _can_lift(context: LineContext, lift: Float[np.ndarray, "m dof"]) -> bool:
    """Check whether a lift keeps off everything fixed, and the object in the hand off the robot."""
    return not context.hits_fixed(lift[::2]) and not context.hits_robot_when_held(lift[::2])


def line_counts(lengths_m: tuple[float, ...], step_m: float) -> list[int]:
    """Return the number of waypoints of each length, in the order given; the longest takes them all."""
    waypoints = waypoints_of(max(lengths_m), step_m)
    return [max(1, round(length / max(lengths_m) * waypoints)) for length in lengths_m]


def _pre_grasp(
    context: LineContext,
    q_grasp: Float[np.ndarray, "dof"],
    backward: Float[np.ndarray, "m dof"],
    reached: int,
    config: CartesianConfig,
) -> tuple[int, bool] | None:
    """Return the number of waypoints back to the pre-grasp, and whether it is free; None if all hit fixed things."""
    counts = [c for c in line_counts(config.back_offs_m, config.step_m) if c <= reached]
    if not counts:
        return None
    free = context.contacts(backward[[c - 1 for c in counts]]).free

    def possible(count: int) -> bool:
        return not context.hits_fixed(np.vstack([q_grasp, backward[:count]])[::2])

    return _first(counts, free, False, possible)


def _first(
    counts: list[int], free: Bool[np.ndarray, "c"], longest_first: bool, possible: Callable[[int], bool]
) -> tuple[int, bool] | None:
    """Return the first possible count, and whether its end is free: free ones in their order, then others by length."""
    blocked = sorted((c for c, f in zip(counts, free) if not f), reverse=longest_first)
    for count, is_free in [(c, True) for c, f in zip(counts, free) if f] + [(c, False) for c in blocked]:
        if possible(count):
            return count, is_free
    return None

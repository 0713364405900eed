"""Plan the free motions of a pick: to the pre-grasp, with the object to the bin, and home."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from itertools import product

import numpy as np
from jaxtyping import Float

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import attached_contacts, carved
from torc.geometry.transforms import invert, make_pose
from torc.motion.lines import LineContext, LinePair
from torc.motion.mover import Mover
from torc.motion.protocol import NoMotionError
from torc.motion.space import FreeSpace, MotionQuery
from torc.motion.timed_motions import timed_motion, way_out
from torc.motion.timing import join, rounded_path, time_path
from torc.records import PlanStage, Trajectory
from torc.robots.description import Qpos
from torc.robots.ik import solve_ik
from torc.robots.kinematics import tool0_poses
from torc.workspace.description import Workspace

_FEWEST_OUT = 5
"""Least number of configurations of a line out; a shorter one leads nowhere else."""


class FreeMotions:
    """Plans free motions of one robot in one workspace. All methods raise NoMotionError if no motion is found."""

    def __init__(self, mover: Mover, workspace: Workspace) -> None:
        self._mover, self._config, self._workspace = mover, mover.config, workspace

    def to_pre_grasp(
        self, context: LineContext, start: Qpos, pairs: list[LinePair], rng: np.random.Generator
    ) -> tuple[Trajectory, LinePair]:
        """Return a motion to one of the pre-grasps, and the approach it leads to; the start may touch something."""
        pairs, opening_m = pairs[: self._config.search.goals], self._mover.opening_m
        world = self._opened(context.world, start, opening_m, strict=False)
        goals = np.stack([pair.approach[0] for pair in pairs])
        margin = self._config.carve_margin_m
        for goal in goals[self._mover.space(world, opening_m).collides(goals)]:
            # Only the object to be grasped can be in the way here: let the hand come close to it at this place.
            world = carved(world, self._mover.arrays, goal, opening_m, margin, only_id=context.own_id)
        space = self._mover.space(world, opening_m)
        open_goals = ~space.collides(goals)
        pairs = [pair for pair, good in zip(pairs, open_goals) if good]
        if not pairs:
            raise NoMotionError(PlanStage.FREE, "every pre-grasp touches something.")
        out = way_out(space, start, rng)
        if out is None:
            raise NoMotionError(PlanStage.FREE, "where the arm is, it touches table, bin or itself.")
        motion, chosen = self._with_room(context, MotionQuery(space, out, goals[open_goals]), rng)
        return self._from(start, motion), pairs[chosen]

    def _with_room(
        self, context: LineContext, query: MotionQuery, rng: np.random.Generator
    ) -> tuple[Trajectory, int]:
        """Return a free motion to one of the pre-grasps, and which; with room to fixed obstacles if possible.

        The gripper's paddings are thin, for grasps in narrow places. Without more room it brushed shelves and the table
        on its way, at full speed. (What is held has thicker ones.)
        """
        failed = NoMotionError(PlanStage.FREE, "nothing was tried.")
        for roomy in (query.with_room(self._config.search.room_m), query):
            try:
                return self._motion(roomy, PlanStage.FREE, rng)
            except NoMotionError as error:
                failed = error
        return self._along_a_line(context, query, rng, failed)

    def to_bin(self, context: LineContext, start: Qpos, rng: np.random.Generator) -> Trajectory:
        """Return the motion with the object to the bin.

        At first the object counts as large as it may be, and what it hid as an obstacle: another object may stand
        there. If arm or object already touch that, or no motion is found, it counts as free; then so does more of the
        start's surroundings; and then the object counts as its visible part alone. If none of this leads to the bin,
        because the object touches something fixed, it first moves away from that, or else is assumed to end there.
        Until then, lines out of narrow places are only for an object as large as it may be: assumed smaller, it was
        torn out of the fingers.
        """
        failed = NoMotionError(PlanStage.TRANSFER, "nothing was tried.")
        for world, held, margin_m, by_line, away in self._assumptions(context, start):
            try:
                world = self._opened(world, start, context.width_m, held, margin_m, strict=not away)
                space = self._mover.space(world, context.width_m, held)
                out = way_out(space, start, rng) if away else start
                if out is None or (away and out is start):
                    continue
                if by_line:
                    return self._from(start, self._out_over_bin(context, space, out, rng))
                return self._over_bin(space, out, rng)
            except NoMotionError as error:
                failed = error
        raise failed

    def _assumptions(
        self, context: LineContext, start: Qpos
    ) -> Iterator[tuple[CollisionWorld, Float[np.ndarray, "a 4"], float, bool, bool]]:
        """Yield what to assume on the way to the bin, the most cautious first.

        Obstacles, extent of the object, room at the start, whether lines out are used, and whether to move away first.
        """
        cautious = context.world.without_object(context.own_id, unknown=False)
        bold, margin_m = context.without_object, self._config.carve_margin_m
        possible = context.held.possible
        for held in (possible, context.held.seen):
            touching = self._mover.space(cautious, context.width_m, held).collides(start[None])[0]
            yield bold if touching else cautious, held, margin_m, held is possible, False
            yield bold, held, (2 if touching else 1) * margin_m, held is possible, False
        yield bold, possible, 2 * margin_m, True, True
        for held in cut_extents(context, start):
            yield bold, held, 2 * margin_m, True, False

    def home(self, context: LineContext, start: Qpos, rng: np.random.Generator) -> Trajectory:
        """Return the motion from over the bin, the object released, back to rest."""
        rest, world = self._mover.arm.rest_qpos, context.without_object
        for place in (start, rest):
            world = self._opened(world, place, self._mover.opening_m)
        query = MotionQuery(self._mover.space(world, self._mover.opening_m), start, rest[None])
        return self._motion(query, PlanStage.TRANSFER, rng)[0]

    def _out_over_bin(
        self, context: LineContext, space: FreeSpace, start: Qpos, rng: np.random.Generator
    ) -> Trajectory:
        """Move to the drop position; first along a line out of the place, if nothing else leads there."""
        try:
            return self._over_bin(space, start, rng)
        except NoMotionError:
            out = self._line_out(context, space, start)
            if len(out) < _FEWEST_OUT:
                raise
            return join([self._timed_line(out), self._over_bin(space, out[-1], rng)])

    def _over_bin(self, space: FreeSpace, start: Qpos, rng: np.random.Generator) -> Trajectory:
        """Move to the drop position that is quick to reach both from here and from the rest position."""
        for goals in self._drop_qpos:
            query = MotionQuery(space, start, goals, space.seconds_between(goals, self._mover.arm.rest_qpos))
            free = query.soonest_free(self._config.search.goals)
            if len(free):
                return self._motion(query.among(free), PlanStage.TRANSFER, rng)[0]
        raise NoMotionError(PlanStage.TRANSFER, "no free configuration above the bin.")

    def _along_a_line(
        self, context: LineContext, query: MotionQuery, rng: np.random.Generator, failed: NoMotionError
    ) -> tuple[Trajectory, int]:
        """Return a free motion whose last part is a straight line along the approach, and its goal.

        Raises `failed` if no goal has one. A tree of long edges hardly gets into a narrow place, such as a shelf; a
        line does.
        """
        lines = [self._line_out(context, query.space, goal) for goal in query.goals]
        usable = [i for i, line in enumerate(lines) if len(line) >= _FEWEST_OUT]
        if not usable:
            raise failed
        ends = np.stack([lines[i][-1] for i in usable])
        motion, chosen = self._motion(replace(query, goals=ends), PlanStage.FREE, rng)
        return join([motion, self._timed_line(lines[usable[chosen]][::-1])]), usable[chosen]

    def _line_out(self, context: LineContext, space: FreeSpace, qpos: Qpos) -> Float[np.ndarray, "m dof"]:
        """Return the path straight back, against the approach, while nothing is touched; it starts with `qpos`."""
        T, backward = tool0_poses(self._mover.arm, qpos[None]), -context.approach_axis
        paths, counts = self._mover.follow(qpos[None], T, backward, self._config.cartesian.line_out_m)
        path = np.vstack([qpos, paths[0, : counts[0]]])
        touching = space.collides(path)
        return path[: np.argmax(touching)] if touching.any() else path

    def _timed_line(self, path: Float[np.ndarray, "m dof"]) -> Trajectory:
        config = self._config.cartesian
        return self._mover.timed_line(path, config.line_out_m, config.lift_speed_m_s)

    def _motion(
        self, query: MotionQuery, stage: PlanStage, rng: np.random.Generator
    ) -> tuple[Trajectory, int]:
        """Return a free motion to one of the goals, and which."""
        found = timed_motion(query, self._mover.arm, self._config, rng)
        if found is PlanStage.TIMING:
            raise NoMotionError(found, f"the path found for the {stage} could not be timed and stay free.")
        if isinstance(found, PlanStage):
            raise NoMotionError(stage, f"no free path was found for the {stage}.")
        return found

    def _from(self, start: Qpos, motion: Trajectory) -> Trajectory:
        """Return the motion, preceded by a straight one from a start close by if it starts elsewhere."""
        for straight in rounded_path(np.stack([start, motion.qpos[0]]), np.zeros(2)):
            motion = join([time_path(straight, self._mover.arm, self._config.timing), motion])
        return motion

    def _opened(
        self,
        world: CollisionWorld,
        qpos: Qpos,
        width_m: float,
        held: Float[np.ndarray, "a 4"] | None = None,
        margin_m: float | None = None,
        strict: bool = True,
    ) -> CollisionWorld:
        """Remove the voxels that the robot touches at qpos from the world: it is there, so they are free.

        strict: raise NoMotionError if anything else is touched there.
        """
        if not self._mover.space(world, width_m, held).collides(qpos[None])[0]:
            return world
        margin_m = self._config.carve_margin_m if margin_m is None else margin_m
        world = carved(world, self._mover.arrays, qpos, width_m, margin_m, held)
        if strict and self._mover.space(world, width_m, held).collides(qpos[None])[0]:
            reason = "where a motion has to start or end, the arm touches table, bin or itself."
            raise NoMotionError(PlanStage.TRANSFER, reason)
        return world

    @cached_property
    def _drop_qpos(self) -> list[Float[np.ndarray, "n dof"]]:
        """Configurations with the gripper pointing down over the bin, one array per height."""
        T_tcp_tool0 = invert(self._mover.robot.gripper.T_tool0_tcp(self._mover.opening_m))
        out = []
        for raised in self._config.drop_raises_m:
            position = np.add(self._workspace.drop_position, (0.0, 0.0, raised))
            poses = []
            for yaw in 2 * np.pi * np.arange(self._config.drop_yaws) / self._config.drop_yaws:
                c, s = np.cos(yaw), np.sin(yaw)
                R = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])
                poses.append(make_pose(R, position) @ T_tcp_tool0)
            solutions = solve_ik(self._mover.arm, np.stack(poses))
            out.append(solutions.qpos[np.isfinite(solutions.qpos[:, :, 0])])
        return out


_SHARES = (0.75, 0.67, 0.5, 0.0)
"""A radius is cut in turn by these factors: to 3/4, 1/2, 1/4, nothing."""


def cut_extents(context: LineContext, qpos: Qpos) -> Iterator[Float[np.ndarray, "a 4"]]:
    """Yield the held object, as spheres (tool0 frame) that touch nothing fixed at a configuration, the largest first.

    Yields nothing if it touched nothing fixed before. The object is there, so it does not extend into a wall or a roof,
    though rough depth may smear it toward them. Spheres that would touch are first shrunk enough, then left out.
    """
    for shares, extent in product((_SHARES, ()), (context.held.possible, context.held.seen)):
        held = _cut(context, qpos, extent, shares)
        if held is not extent:
            yield held


def _cut(
    context: LineContext, qpos: Qpos, held: Float[np.ndarray, "a 4"], shares: tuple[float, ...]
) -> Float[np.ndarray, "b 4"]:
    for share in (*shares, None):
        touching = attached_contacts(context.world, context.mover.arrays, qpos, context.width_m, held)
        if not touching.any():
            break
        if share is None:
            held = held[~touching]
        else:
            held = np.where(touching[:, None], held * (1.0, 1.0, 1.0, share), held)
    return held

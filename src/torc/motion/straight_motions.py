"""The straight motions of a pick, down to the grasp and up again: candidates, refinement, timing."""

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from torc.motion.config import MotionConfig
from torc.motion.failure import NoMotionError
from torc.motion.following import follow_line
from torc.motion.line_context import LineContext
from torc.motion.lines import LinePair, has_lines, line_fault, line_pairs
from torc.motion.timing import time_line
from torc.records import PlanStage, Trajectory
from torc.robots.description import ArmDescription
from torc.robots.ik import solve_ik

if TYPE_CHECKING:
    from torc.motion.pink_lines import PinkFollower


class StraightMotions:
    """Approach and lift of one arm."""

    def __init__(self, arm: ArmDescription, config: MotionConfig) -> None:
        self._arm, self._config = arm, config

    def candidates(
        self,
        context: LineContext,
        qpos_reported: Float[np.ndarray, "dof"],
        qpos_start: Float[np.ndarray, "dof"],
    ) -> list[LinePair]:
        """Approaches and lifts, best first. Raises NoMotionError if there is none with a free pre-grasp.

        Args:
            context: the grasp.
            qpos_reported: the grasp report's own solution, tried first; not finite if it has none.
            qpos_start: where the arm is.
        """
        branches, config = self._branches(context, qpos_reported), self._config.cartesian
        blocked: list[LinePair] = []
        for i in range(config.max_rounds):
            some = branches[i * config.max_branches : (i + 1) * config.max_branches]
            pairs, others = line_pairs(context, some, qpos_start, config)
            if pairs:
                return pairs
            blocked += others
        why = "no pre-grasp is free" if blocked else "no straight approach and lift within reach"
        raise NoMotionError(PlanStage.APPROACH, f"{why}.")

    def exist(self, context: LineContext, qpos_reported: Float[np.ndarray, "dof"]) -> bool:
        """Whether `candidates` finds any; in a fraction of the time."""
        config = self._config.cartesian
        try:
            branches = self._branches(context, qpos_reported)[: config.max_rounds * config.max_branches]
        except NoMotionError:
            return False
        few = 4  # Mostly one of the first does.
        return any(has_lines(context, branches[i : i + few], config) for i in range(0, len(branches), few))

    def timed(self, context: LineContext, pair: LinePair) -> tuple[Trajectory, Trajectory]:
        """Approach and lift as trajectories. Raises NoMotionError if they do not fit together."""
        approach, lift = self._refined(context, pair)
        config = self._config.cartesian
        return (
            self._timed_line(approach, pair.approach_poses, config.approach_speed_m_s),
            self._timed_line(lift, pair.lift_poses, config.lift_speed_m_s),
        )

    def load(self) -> None:
        """Load now what is else loaded at first use: pink and pinocchio take a second."""
        if self._config.cartesian.use_pink:
            _ = self._follower

    def _branches(self, context: LineContext, qpos_reported: np.ndarray) -> Float[np.ndarray, "b dof"]:
        """Free inverse-kinematics solutions of the grasp; the reported one first."""
        solutions = solve_ik(self._arm, context.T_world_tool0[None]).of(0)
        if np.all(np.isfinite(qpos_reported)):
            solutions = np.vstack([qpos_reported, solutions])
        if len(solutions) == 0:
            raise NoMotionError(PlanStage.INVERSE_KINEMATICS, "out of reach.")
        free = context.contacts(solutions).free
        if not free.any():
            raise NoMotionError(PlanStage.INVERSE_KINEMATICS, "the arm touches something in every solution.")
        return solutions[free]

    def _refined(self, context: LineContext, pair: LinePair) -> tuple[np.ndarray, np.ndarray]:
        """Joint paths of approach and lift: pink's where it stays on the lines, else the compiled follower's."""
        config = self._config.cartesian
        if not config.use_pink:
            return pair.approach, pair.lift
        approach = self._pink_line(pair.approach, pair.approach_poses, config.approach_speed_m_s)
        lift = self._relifted(context, pair, approach[-1])
        return approach, self._pink_line(lift, pair.lift_poses, config.lift_speed_m_s)

    def _relifted(
        self, context: LineContext, pair: LinePair, q_grasp: Float[np.ndarray, "dof"]
    ) -> Float[np.ndarray, "k dof"]:
        """The lift from a configuration that differs a little from the one it was planned for."""
        paths, counts = follow_line(
            context.robot,
            q_grasp[None],
            pair.lift_poses[1:],
            self._arm.lower,
            self._arm.upper,
            self._config.cartesian.max_joint_step_rad,
        )
        if counts[0] < len(pair.lift_poses) - 1:
            raise NoMotionError(PlanStage.LIFT, "the lift cannot be followed from where the approach ends.")
        return np.vstack([q_grasp, paths[0]])

    def _pink_line(
        self, path: Float[np.ndarray, "m dof"], poses: Float[np.ndarray, "m 4 4"], speed_m_s: float
    ) -> Float[np.ndarray, "m dof"]:
        """The line by pink if that is sound, else the path given."""
        dt_s = self._config.cartesian.step_m / speed_m_s
        followed = self._follower.follow(path[0], poses[1:], path[1:], dt_s)
        if followed is None:
            return path
        followed = np.vstack([path[0], followed])
        sound = line_fault(self._arm, followed, poses, self._config.cartesian) is None
        return followed if sound else path

    def _timed_line(
        self, path: Float[np.ndarray, "m dof"], poses: Float[np.ndarray, "m 4 4"], speed_m_s: float
    ) -> Trajectory:
        distances = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1)
        return time_line(path, distances, speed_m_s, self._arm, self._config.timing)

    @cached_property
    def _follower(self) -> "PinkFollower":
        # Imported when needed, see `load`.
        from torc.motion.pink_lines import PinkFollower

        return PinkFollower(self._arm, self._config.cartesian.limit_margin_rad)

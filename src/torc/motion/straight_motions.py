"""Plan the straight motions of a pick, down to the grasp and up again: candidates and timing."""

import numpy as np
from jaxtyping import Float

from torc.motion.config import MotionConfig
from torc.motion.following import waypoints_of
from torc.motion.line_context import LineContext
from torc.motion.lines import LinePair, has_lines, line_pairs
from torc.motion.protocol import NoMotionError
from torc.motion.timing import time_line
from torc.records import PlanStage, Trajectory
from torc.robots.description import ArmDescription
from torc.robots.ik import solve_ik


class StraightMotions:
    """Plans approach and lift of one arm."""

    def __init__(self, arm: ArmDescription, config: MotionConfig) -> None:
        self._arm, self._config = arm, config

    def candidates(
        self,
        context: LineContext,
        qpos_reported: Float[np.ndarray, "dof"],
        qpos_start: Float[np.ndarray, "dof"],
    ) -> list[LinePair]:
        """Return approaches and lifts, best first. Raises NoMotionError if none has a free pre-grasp.

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
        """Check whether `candidates` finds any, in a fraction of the time."""
        config = self._config.cartesian
        try:
            branches = self._branches(context, qpos_reported)[: config.max_rounds * config.max_branches]
        except NoMotionError:
            return False
        few = 4  # Usually one of the first does.
        return any(has_lines(context, branches[i : i + few], config) for i in range(0, len(branches), few))

    def timed(self, pair: LinePair) -> tuple[Trajectory, Trajectory]:
        """Return approach and lift as trajectories."""
        config = self._config.cartesian
        return (
            self._timed_line(pair.approach, max(config.back_offs_m), config.approach_speed_m_s),
            self._timed_line(pair.lift, max(config.lifts_m), config.lift_speed_m_s),
        )

    def _branches(self, context: LineContext, qpos_reported: np.ndarray) -> Float[np.ndarray, "b dof"]:
        """Return free inverse-kinematics solutions of the grasp, the reported one first."""
        solutions = solve_ik(self._arm, context.T_world_tool0[None]).of(0)
        if np.all(np.isfinite(qpos_reported)):
            solutions = np.vstack([qpos_reported, solutions])
        if len(solutions) == 0:
            raise NoMotionError(PlanStage.INVERSE_KINEMATICS, "out of reach.")
        free = context.contacts(solutions).free
        if not free.any():
            raise NoMotionError(PlanStage.INVERSE_KINEMATICS, "the arm touches something in every solution.")
        return solutions[free]

    def _timed_line(self, path: Float[np.ndarray, "m dof"], longest_m: float, speed_m_s: float) -> Trajectory:
        """Time a path along some of the evenly spaced waypoints of the longest line."""
        spacing_m = longest_m / waypoints_of(longest_m, self._config.cartesian.step_m)
        return time_line(path, spacing_m * np.arange(len(path)), speed_m_s, self._arm, self._config.timing)

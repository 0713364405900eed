"""A robot that moves, with what all its motions need; and straight lines of the flange, followed by Newton steps.

Each waypoint of a line is solved by damped least squares from the one before, so a redundant arm moves as little as it
can.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import robot_arrays
from torc.collision.placement import RobotArrays
from torc.geometry.transforms import kernel_array
from torc.motion.config import MotionConfig
from torc.motion.line_kernels import LineRules, follow_each
from torc.motion.space import FreeSpace, free_space
from torc.motion.timing import time_line
from torc.records import Trajectory
from torc.robots.description import ArmDescription, RobotDescription


@dataclass(frozen=True)
class Mover:
    """A robot and the settings of its motions."""

    robot: RobotDescription
    config: MotionConfig

    @property
    def arm(self) -> ArmDescription:
        """The robot's arm."""
        return self.robot.arm

    @cached_property
    def arrays(self) -> RobotArrays:
        """The robot for the compiled checks."""
        return robot_arrays(self.robot)

    @property
    def opening_m(self) -> float:
        """Opening of the gripper until it closes on the object."""
        most, wanted = self.robot.gripper.max_width_m, self.config.opening_m
        return most if wanted is None else min(wanted, most)

    def space(
        self, world: CollisionWorld, width_m: float, attached: Float[np.ndarray, "a 4"] | None = None
    ) -> FreeSpace:
        """Return where the arm may be with that opening, and spheres attached to the gripper (see `free_space`)."""
        arm = self.arm
        return free_space(self.arrays, world, width_m, (arm.lower, arm.upper), arm.max_speed, attached)

    def follow(
        self,
        starts: Float[np.ndarray, "b dof"],
        Ts_world_tool0: Float[np.ndarray, "*p 4 4"],
        directions: Float[np.ndarray, "*d 3"],
        length_m: float,
    ) -> tuple[Float[np.ndarray, "b m dof"], Int[np.ndarray, "b"]]:
        """Return joint paths along straight lines of the flange, and how many waypoints in a row each one meets.

        Poses at the starts and directions (unit vectors, world frame) may be one for all; the orientation is kept. The
        paths leave out the starts, and are NaN beyond the last waypoint that is met.
        """
        starts, n, steps = kernel_array(starts), len(starts), self.waypoints(length_m)
        paths = np.full((n, steps, starts.shape[1]), np.nan)
        counts = np.zeros(n, dtype=np.int64)
        follow_each(
            starts,
            kernel_array(np.broadcast_to(Ts_world_tool0, (n, 4, 4))[:, :3]),
            kernel_array(np.broadcast_to(directions, (n, 3))),
            length_m / steps,
            self.arrays,
            self.line_rules,
            paths,
            counts,
        )
        return paths, counts

    def timed_line(self, path: Float[np.ndarray, "m dof"], longest_m: float, speed_m_s: float) -> Trajectory:
        """Time a path along the first waypoints of a line of that length."""
        spacing_m = longest_m / self.waypoints(longest_m)
        return time_line(path, spacing_m * np.arange(len(path)), speed_m_s, self.arm, self.config.timing)

    def waypoints(self, length_m: float) -> int:
        """Return the number of waypoints of a line, not counting its start."""
        return max(1, int(np.ceil(length_m / self.config.cartesian.step_m - 1e-9)))

    def line_counts(self, lengths_m: tuple[float, ...]) -> list[int]:
        """Return the number of waypoints of each length on the line of the longest, in the order given."""
        longest_m = max(lengths_m)
        return [max(1, round(length / longest_m * self.waypoints(longest_m))) for length in lengths_m]

    @cached_property
    def line_rules(self) -> LineRules:
        """The settings of straight lines for the compiled functions."""
        config = self.config.cartesian
        lift_m, back_off_m = max(config.lifts_m), max(config.back_offs_m)
        return LineRules(
            lift_spacing_m=lift_m / self.waypoints(lift_m),
            approach_spacing_m=back_off_m / self.waypoints(back_off_m),
            lift=min(self.line_counts(config.lifts_m)),
            back_offs=np.unique(self.line_counts(config.back_offs_m)),
            lower=kernel_array(self.arm.lower + config.limit_margin_rad),
            upper=kernel_array(self.arm.upper - config.limit_margin_rad),
            max_step_rad=float(config.max_joint_step_rad),
            branches=config.max_rounds * config.max_branches,
            opening_m=float(self.opening_m),
        )

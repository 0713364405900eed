"""An arm and a gripper that obey at once, and fail where they are told to."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from torc.records import Trajectory
from torc.robots.protocols import ContactGuard, FollowResult, GripperState


@dataclass
class FakeArm:
    """An arm that is wherever its last motion ended. `stop_at` has, per number of a motion, the fraction of its samples
    after which contact stops it; without a guard the motion ends there too, but not by contact.
    """

    qpos: Float[np.ndarray, "dof"]
    stop_at: dict[int, float] = field(default_factory=dict)
    followed: list[Trajectory] = field(default_factory=list)
    guards: list[ContactGuard | None] = field(default_factory=list)

    def follow(self, trajectory: Trajectory, guard: ContactGuard | None = None) -> FollowResult:
        """Jump along the trajectory. Raises ValueError if it starts elsewhere or its times do not rise."""
        gap = np.abs(trajectory.qpos[0] - self.qpos).max()
        if gap > 0.01 or np.any(np.diff(trajectory.times_s) <= 0):
            raise ValueError("A trajectory must start where the arm is, and its times must rise.")
        number = len(self.followed)
        self.followed.append(trajectory)
        self.guards.append(guard)
        stop = self.stop_at.get(number)
        last = len(trajectory.qpos) - 1 if stop is None else int(stop * (len(trajectory.qpos) - 1))
        self.qpos = trajectory.qpos[last].copy()
        touched = stop is not None and guard is not None
        return FollowResult(stop is None, touched, self.qpos.copy(), "touched a box" if touched else "")


@dataclass
class FakeGripper:
    """A gripper with an object of object_width_m between its fingers, or None, which is gone after `loses_after` looks
    at `state` while closed.
    """

    object_width_m: float | None = 0.04
    loses_after: int | None = None
    max_width_m: float = 0.085
    width_m: float = 0.085
    commands: list[tuple[str, float]] = field(default_factory=list)
    _closed: bool = False
    _looks: int = 0

    def open(self, width_m: float) -> GripperState:
        """Opens."""
        self.commands.append(("open", width_m))
        self.width_m, self._closed = width_m, False
        return self.state

    def close(self, force_n: float) -> GripperState:
        """Closes on the object, if there is one."""
        self.commands.append(("close", force_n))
        self._closed = True
        return self.state

    @property
    def state(self) -> GripperState:
        """What it feels."""
        if not self._closed:
            return GripperState(self.width_m, False)
        self._looks += 1
        if self.loses_after is not None and self._looks > self.loses_after:
            self.object_width_m = None
        self.width_m = self.object_width_m or 0.0
        return GripperState(self.width_m, self.object_width_m is not None)

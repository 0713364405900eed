"""Check each motion before a driver gets it, and watch the arm until it rests.

The supervisor follows common laboratory practice. An e-stop is hardware, and only reported here. A motion starts where
the arm is, or not at all. If the arm's state gets too old, the arm is stopped. After a stop a person looks, and
resumes; nothing is repeated automatically, and the gripper keeps its grip.
"""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.interrupts import interrupts_held
from torc.records import Trajectory
from torc.robots.description import RobotDescription
from torc.robots.execution import reverse, starting_from
from torc.robots.kinematics import tool0_poses
from torc.robots.protocols import ContactGuard, FollowResult
from torc_lab.checks import MotionLimits, form_faults, motion_faults, stretch_for, stretched
from torc_lab.protocols import ArmDriver, ArmStatus, LabError, MotionRefusedError, RobotStoppedError

_NOT_OURS = "still moves, and not by torc: somebody else commands it, or it cannot be stopped from here. Use the e-stop"
_STILL = 0.25
"""A still arm moves, from one status to the next, by at most this share of its start tolerance."""

Confirm = Callable[[str, Trajectory], bool]
"""Returns whether a motion may go; called before each motion with a line that describes it."""


@dataclass(frozen=True)
class SupervisorConfig:
    """How closely an arm is watched.

    Attributes:
        period_s: time between two looks at the arm.
        stale_s: a status older than this stops the arm.
        following_rad: the arm is stopped if any joint is further than this from its path.
        lag_s: the arm may be behind or ahead of its path by this time.
        late_s: a motion counts as stuck this long after its planned end.
        rest_s: how long to wait for the arm to come to rest.
        bend_rad: a motion that starts within this of the arm's position, in every joint, is bent to start there.
        creep_rad: an arm at rest may settle by this while a person confirms.
        goal_rad: the arm has arrived once every joint is this close to the goal.
        short_rad: an arm that ends further from its goal counts as stopped, even if it reports success.
        resting_rad_s: the arm rests if it is slower than this.
        still_s: a stopped arm must be slower than resting_rad_s for this long, as a motion that others command may
            begin slowly.
        future_s: a status further ahead of this machine's clock than this is a driver fault.
    """

    period_s: float = 0.02
    stale_s: float = 0.3
    following_rad: float = 0.15
    lag_s: float = 0.5
    late_s: float = 3.0
    rest_s: float = 3.0
    bend_rad: float = 0.02
    creep_rad: float = 0.002
    goal_rad: float = 0.01
    short_rad: float = 0.05
    resting_rad_s: float = 0.01
    still_s: float = 0.3
    future_s: float = 0.05


class SupervisedArm:
    """The `Arm` of torc.robots.protocols on a real arm. It slows trajectories down to keep to the limits."""

    def __init__(
        self,
        driver: ArmDriver,
        robot: RobotDescription,
        limits: MotionLimits,
        config: SupervisorConfig | None = None,
        *,
        confirm: Confirm = lambda what, trajectory: True,
    ) -> None:
        self.driver, self.robot, self.limits = driver, robot, limits
        self.config, self.confirm = config or SupervisorConfig(), confirm
        self._halted = ""

    @property
    def halted(self) -> str:
        """Return why nothing moves until `resume`; "" if the arm may move."""
        return self._halted

    @property
    def qpos(self) -> Float[np.ndarray, "dof"]:
        """Return the joint positions now, radians. Raises LabError if they are not known."""
        return self._awaited().qpos.copy()

    def resume(self) -> None:
        """Allow motions again, after a person has looked at the robot.

        Raises RobotStoppedError if the controller allows no motion or the arm still moves, LabError if it is silent.
        """
        status = self._awaited()
        if status.stopped:
            raise RobotStoppedError(f"{self.driver.name} does not move yet: {status.stopped}.")
        if not self._rests(self.config.rest_s, self.config.still_s):
            raise RobotStoppedError(f"{self.driver.name} {_NOT_OURS}.")
        self._halted = ""

    def follow(self, trajectory: Trajectory, guard: ContactGuard | None = None) -> FollowResult:
        """Move along a trajectory; return when the arm rests at its end, or has backed off after a contact.

        Raises MotionRefusedError if the motion may not begin, RobotStoppedError if it was stopped on the way, and
        LabError if the arm is lost. KeyboardInterrupt stops the arm, and is raised again once it rests.
        """
        planned = self._allowed(trajectory)
        felt = guard if self.driver.feels_contact else None
        try:
            self.driver.start(planned)
            touched = self._watch(planned, felt)
        except BaseException as error:  # an interrupt, too: some of the motion may be on its way
            self._halted = str(error) or type(error).__name__
            with interrupts_held():
                rests = self._stop()
            stop, refused = error, isinstance(error, LabError) and not isinstance(error, RobotStoppedError)
            if refused and (stopped := self._stopped_by_now()):
                stop = RobotStoppedError(f"{self.driver.name} was stopped: {stopped} ({error})")
            if not rests and isinstance(stop, RobotStoppedError):
                stop = RobotStoppedError(f"{stop} It {_NOT_OURS}.")
            if stop is not error:
                raise stop from error
            raise
        if touched and guard is not None:
            if not self._stop():
                self._halted = "it moved on after a contact"
                raise RobotStoppedError(f"{self.driver.name} felt a contact. It {_NOT_OURS}.")
            self._back_off(planned, guard)
            return FollowResult(False, True, self.qpos, f"{self.driver.name} felt a contact")
        qpos = self.qpos
        error_rad = float(np.abs(qpos - planned.qpos[-1]).max())
        if error_rad > self.config.short_rad:
            self._halted = f"it said that it was done {error_rad:.2f} rad short of the goal"
            raise RobotStoppedError(f"{self.driver.name}: {self._halted}.")
        reached = error_rad <= self.config.goal_rad
        return FollowResult(
            reached, False, qpos, "" if reached else f"stopped {error_rad:.3f} rad short of the goal"
        )

    def _allowed(self, trajectory: Trajectory) -> Trajectory:
        """Return the trajectory to send, checked and confirmed. Raises MotionRefusedError."""
        if self._halted:
            raise MotionRefusedError(
                f"{self.driver.name} was stopped ({self._halted}); look at it, then resume."
            )
        status = self._awaited()
        if status.stopped:
            raise MotionRefusedError(f"{self.driver.name} does not move: {status.stopped}.")
        if status.moving:
            raise MotionRefusedError(f"{self.driver.name} moves already, and not by torc.")
        status = self._settled(status)
        planned = self._checked(trajectory, status)
        if not self.confirm(f"{self.driver.name}: a motion of {planned.duration_s:.1f} s", planned):
            raise MotionRefusedError("The motion was not confirmed.")
        # Whoever confirms may have taken a while.
        status = self._awaited()
        gap_rad = np.abs(status.qpos - planned.qpos[0]).max()
        if status.stopped or gap_rad > max(self.config.creep_rad, self.driver.start_tolerance_rad):
            raise MotionRefusedError(
                f"{self.driver.name} moved, or was stopped, before the motion was confirmed."
            )
        # A servo that creeps into place is no more than that: the motion is bent once more.
        return planned if gap_rad <= self.driver.start_tolerance_rad else self._checked(planned, status)

    def _checked(self, trajectory: Trajectory, status: ArmStatus) -> Trajectory:
        """Return the trajectory bent to start at the arm, and stretched to the limits. Raises MotionRefusedError."""
        if faults := form_faults(trajectory, self.robot.arm.dof):
            raise MotionRefusedError(f"The motion is not sent to {self.driver.name}: {'; '.join(faults)}.")
        if np.abs(trajectory.qpos[0] - status.qpos).max() <= self.config.bend_rad:
            trajectory = starting_from(trajectory, status.qpos)
        planned = stretched(trajectory, stretch_for(trajectory, self.limits, self.robot))
        faults = motion_faults(planned, status.qpos, self.driver.start_tolerance_rad, self.limits, self.robot)
        if faults:
            raise MotionRefusedError(f"The motion is not sent to {self.driver.name}: {'; '.join(faults)}.")
        return planned

    def _fresh(self, patience_s: float = 0.0) -> ArmStatus:
        """Return the latest status. Raises LabError if it stays too old, or its stamp is in the future."""
        config, deadline = self.config, time.monotonic() + patience_s
        while True:
            status = self.driver.status()
            age_s = time.monotonic() - status.stamp_s
            if not age_s >= -config.future_s:
                raise LabError(
                    f"{self.driver.name} stamps its states {-age_s:.1f} s in the future: a driver's stamp_s is by "
                    "time.monotonic()."
                )
            if age_s <= config.stale_s:
                return status
            if time.monotonic() >= deadline:
                raise LabError(f"{self.driver.name} has said nothing for {age_s:.1f} s.")
            time.sleep(config.period_s)

    def _awaited(self) -> ArmStatus:
        """Return the latest status while torc does not move the arm. It waits a little, as messages that arrived during
        heavy computing may not be read yet.
        """
        return self._fresh(2 * self.config.stale_s)

    def _settled(self, status: ArmStatus) -> ArmStatus:
        """Wait until the arm is still enough to start, and return its status. Raises MotionRefusedError."""
        deadline = time.monotonic() + self.config.rest_s
        while time.monotonic() < deadline:
            time.sleep(self.config.period_s)
            newer = self._awaited()
            if newer.stamp_s == status.stamp_s:
                continue
            if np.abs(newer.qpos - status.qpos).max() <= _STILL * self.driver.start_tolerance_rad:
                return newer
            status = newer
        raise MotionRefusedError(f"{self.driver.name} does not come to rest.")

    def _watch(self, planned: Trajectory, guard: ContactGuard | None) -> bool:
        """Watch until the arm rests; return whether contact ended it. Raises RobotStoppedError or LabError."""
        config, began = self.config, time.monotonic()
        while True:
            time.sleep(config.period_s)
            status, elapsed = self._fresh(), time.monotonic() - began
            if guard is not None and status.contact_n > guard.max_force_n:
                return True
            if status.stopped:
                raise RobotStoppedError(f"{self.driver.name} was stopped: {status.stopped}")
            ended = self.driver.ended()
            if ended:
                raise RobotStoppedError(f"{self.driver.name} ended the motion early: {ended}")
            away = off_path_rad(planned, status.qpos, elapsed, config.lag_s)
            if away > config.following_rad:
                raise RobotStoppedError(
                    f"{self.driver.name} is {away:.2f} rad off its path after {elapsed:.1f} s, and was stopped"
                )
            if ended is not None and not status.moving and self._rests(config.rest_s):
                return False
            if elapsed > planned.duration_s + config.late_s:
                raise RobotStoppedError(
                    f"{self.driver.name} did not finish a motion of {planned.duration_s:.1f} s in {elapsed:.1f} s, "
                    "and was stopped"
                )

    def _rests(self, limit_s: float, still_s: float = 0.0) -> bool:
        """Return whether the arm comes to rest within a time limit. Its speed is measured from status to status, and
        must stay low for `still_s`.
        """
        began, last, since_s = time.monotonic(), self._fresh(), np.inf
        while time.monotonic() - began < limit_s + still_s:
            time.sleep(self.config.period_s)
            status = self._fresh()
            if status.stamp_s > last.stamp_s:
                rate = np.abs(status.qpos - last.qpos).max() / (status.stamp_s - last.stamp_s)
                slow = rate < self.config.resting_rad_s and not status.moving
                since_s = min(since_s, last.stamp_s) if slow else np.inf
                if status.stamp_s - since_s >= still_s:
                    return True
                last = status
        return False

    def _stop(self) -> bool:
        """Stop the arm and wait until it rests; return False if it still moves, True also if that is not known."""
        try:
            self.driver.stop()
            return self._rests(self.config.rest_s, self.config.still_s)
        except LabError:
            # It cannot be reached, or says nothing any more: its own watchdog, or the e-stop, has to do it.
            return True

    def _stopped_by_now(self) -> str:
        """Return why the arm is stopped, from a status newer than this call; "" if it is not, or says nothing.

        If an e-stop is pressed just before a motion is sent, the driver only knows that the controller refused it.
        """
        since_s = time.monotonic()
        with suppress(LabError):
            while (status := self._fresh()).stamp_s < since_s:
                time.sleep(self.config.period_s)
            return status.stopped
        return ""

    def _back_off(self, planned: Trajectory, guard: ContactGuard) -> None:
        """Move back along the path until the flange is relief_m away from where it stopped."""
        back = reverse(planned, self.qpos)
        if back is None:
            return
        flange = tool0_poses(self.robot.arm, back.qpos)[:, :3, 3]
        far = np.flatnonzero(np.linalg.norm(flange - flange[0], axis=1) >= guard.relief_m)
        last = int(far[0]) + 1 if len(far) else len(back.times_s)
        short = Trajectory(back.times_s[:last], back.qpos[:last], back.qvel[:last].copy())
        if last >= 2:
            short.qvel[-1] = 0.0
            self.follow(short)


def off_path_rad(
    trajectory: Trajectory, qpos: Float[np.ndarray, "dof"], elapsed_s: float, lag_s: float
) -> float:
    """Return the distance of the arm from its path, radians: the greatest joint error, at the best-matching time.

    Args:
        qpos: joint positions of the arm, radians.
        elapsed_s: time since the motion began.
        lag_s: how far the arm may be behind or ahead in time.
    """
    times = np.clip(np.linspace(elapsed_s - lag_s, elapsed_s + lag_s, 41), 0, trajectory.duration_s)
    path = np.stack([np.interp(times, trajectory.times_s, q) for q in trajectory.qpos.T], axis=1)
    return float(np.abs(path - qpos).max(axis=1).min())

"""Carry out a planned pick on any hardware: open, free motion, guarded approach, close, lift, transfer, open, home.

Whatever stops a motion, the arm backs off along the path it came (known to be free) and ends at rest if it can.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from torc.records import PickPlan, PickResult, Touch, Trajectory
from torc.robots.protocols import Arm, ContactGuard, Gripper, GripperState


@dataclass(frozen=True)
class ExecutionConfig:
    """How a pick is carried out.

    Attributes:
        free_guard, approach_guard: when these motions stop on contact; None: never.
        carry_guard: of lift, transfer and home, during which something may be in the hand.
        retreat_guard: of the motions back.
        bend_rad: a free motion is bent to start where the arm is if that is within this of its planned start, in every
            joint; otherwise it is passed on as planned, and a real arm's supervisor refuses it. Later motions are bent
            by as much as the arm may have fallen short of the one before.
        close_within_rad: an approach stopped by contact this close to the grasp, in every joint, still closes the
            gripper: about two centimetres, as in the trials that the grasp score learns from.
        goal_slack_rad: a motion that ends this close to its goal counts as arrived.
    """

    grip_force_n: float = 50.0
    free_guard: ContactGuard | None = field(default_factory=ContactGuard)
    approach_guard: ContactGuard | None = field(default_factory=ContactGuard)
    carry_guard: ContactGuard | None = None
    retreat_guard: ContactGuard | None = None
    bend_rad: float = 0.06
    close_within_rad: float = 0.04
    goal_slack_rad: float = 0.05


_START_SLACK_RAD = 0.01
"""A motion that starts further than this from the arm's position is bent to start there."""


class Phase(StrEnum):
    """The steps of a pick; a retreat goes back along one of its motions."""

    OPEN = "open"
    FREE = "free"
    APPROACH = "approach"
    CLOSE = "close"
    LIFT = "lift"
    TRANSFER = "transfer"
    RELEASE = "release"
    HOME = "home"
    RETREAT = "retreat"


@dataclass(frozen=True)
class PhaseTrace:
    """One step: the commanded motion of the arm, or opening of the gripper (0 for closing), and its outcome."""

    phase: Phase
    trajectory: Trajectory | None
    width_m: float | None
    reached: bool
    stopped_by_contact: bool
    qpos: Float[np.ndarray, "dof"]
    gripper: GripperState
    detail: str = ""


@dataclass(frozen=True)
class ExecutionTrace:
    """One pick as it went.

    Attributes:
        result: as the gripper felt it.
        delivered: it still held over the bin, and let go there.
        at_home: the arm ended where it should wait: the end of `home`, or the start of `free`.
        touch: where an unexpected contact ended the approach, if one did.
    """

    result: PickResult
    phases: tuple[PhaseTrace, ...]
    held_after_lift: bool
    delivered: bool
    at_home: bool
    detail: str
    touch: Touch | None = None


def execute_pick(
    arm: Arm,
    gripper: Gripper,
    plan: PickPlan,
    config: ExecutionConfig | None = None,
    on_phase: Callable[[PhaseTrace], None] | None = None,
    is_target: Callable[[], bool] | None = None,
) -> ExecutionTrace:
    """Carry out one pick; return when the arm rests at home again, or can get no further.

    Args:
        arm, gripper: the hardware.
        plan: the pick.
        config: guards and tolerances.
        on_phase: called after each step.
        is_target: called after a lift with something in the hand; without it, the plan's `is_target` decides.
    """
    run = _Run(arm, gripper, plan, config or ExecutionConfig(), on_phase)
    run.open(Phase.OPEN)
    if not run.follow(Phase.FREE, plan.free, run.config.free_guard):
        return run.give_up("free motion", PickResult.NOT_REACHED)
    if not run.follow(Phase.APPROACH, plan.approach, run.config.approach_guard) and not run.near_grasp():
        return run.give_up("approach")
    run.close()
    if not run.follow(Phase.LIFT, plan.lift, run.config.carry_guard):
        run.open(Phase.RELEASE)
        return run.give_up("lift")
    run.held_after_lift = run.gripper.state.holding
    target = plan.is_target
    if run.held_after_lift and is_target is not None:
        target = is_target()
    if not run.follow(Phase.TRANSFER, plan.transfer, run.config.carry_guard):
        # Put it back where it stood. If the arm cannot get there it stops: letting go high up would drop the object,
        # and off
        # its path the arm must not jump to an earlier one.
        if not run.retreat(2):
            return run.trace(PickResult.STOPPED, False, run.why("transfer"))
        run.open(Phase.RELEASE)
        return run.give_up("transfer")
    # An empty hand goes over the bin, too. That path is known to be free, while back down in the clutter the fingers
    # could
    # land on what the failed grasp has moved, and press it against the table.
    still = run.gripper.state.holding
    run.open(Phase.RELEASE)
    home = run.follow(Phase.HOME, run.plan.home, run.config.carry_guard)
    if not run.held_after_lift:
        return run.trace(PickResult.MISSED, home, "nothing was between the fingers after the lift")
    if not still:
        return run.trace(PickResult.SLIPPED, home, "the object slipped out of the fingers before the bin")
    run.delivered = True
    return run.trace(PickResult.RETRIEVED if target else PickResult.REMOVED, home, "delivered to the bin")


def reverse(
    trajectory: Trajectory, qpos: Float[np.ndarray, "dof"], slowdown: float = 1.5, ramp_s: float = 0.2
) -> Trajectory | None:
    """Return the motion back to the start of a trajectory; None if the arm is there already.

    Args:
        trajectory: the motion so far.
        qpos: where the arm rests, near the point where it stopped.
        slowdown: the motion back is slower by this factor.
        ramp_s: time over which its speed rises.
    """
    nearest = int(np.argmin(np.linalg.norm(trajectory.qpos - qpos, axis=1)))
    if nearest == 0:
        return None
    back = slice(nearest, None, -1)
    distance = trajectory.times_s[nearest] - trajectory.times_s[back]
    speed = 1.0 / slowdown
    ramping = distance < 0.5 * speed * ramp_s
    times = np.where(ramping, np.sqrt(2.0 * ramp_s * distance / speed), distance / speed + 0.5 * ramp_s)
    rates = speed * np.minimum(times / ramp_s, 1.0) if ramp_s > 0 else np.full(len(times), speed)
    path, velocities = trajectory.qpos[back].copy(), -trajectory.qvel[back] * rates[:, None]
    path[0], velocities[0] = qpos, 0.0
    return Trajectory(times, path, velocities)


def starting_from(trajectory: Trajectory, qpos: Float[np.ndarray, "dof"]) -> Trajectory:
    """Bend the trajectory to start at qpos and end where it did; the offset fades out over its duration."""
    s = trajectory.times_s / trajectory.duration_s
    fade, rate = 1.0 - s * s * (3.0 - 2.0 * s), -6.0 * s * (1.0 - s) / trajectory.duration_s
    offset = qpos - trajectory.qpos[0]
    qpos, qvel = trajectory.qpos + fade[:, None] * offset, trajectory.qvel + rate[:, None] * offset
    return Trajectory(trajectory.times_s, qpos, qvel)


class _Run:
    """A pick in progress: issues and records all commands."""

    def __init__(
        self,
        arm: Arm,
        gripper: Gripper,
        plan: PickPlan,
        config: ExecutionConfig,
        on_phase: Callable[[PhaseTrace], None] | None,
    ) -> None:
        self.arm, self.gripper, self.plan, self.config, self.on_phase = arm, gripper, plan, config, on_phase
        self.phases: list[PhaseTrace] = []
        self.way: list[Trajectory] = []
        self.held_after_lift = self.delivered = False

    def open(self, phase: Phase) -> None:
        """Open the gripper fully."""
        width_m = self.gripper.max_width_m
        state = self.gripper.open(width_m)
        self._note(PhaseTrace(phase, None, width_m, True, False, self.arm.qpos, state))

    def close(self) -> None:
        """Close the gripper on the object."""
        state = self.gripper.close(self.config.grip_force_n)
        self._note(PhaseTrace(Phase.CLOSE, None, 0.0, state.holding, False, self.arm.qpos, state))

    def follow(self, phase: Phase, trajectory: Trajectory, guard: ContactGuard | None) -> bool:
        """Move the arm from its actual position; return whether it arrived."""
        gap_rad = float(np.abs(self.arm.qpos - trajectory.qpos[0]).max())
        if _START_SLACK_RAD < gap_rad <= self._bend_rad(phase):
            trajectory = starting_from(trajectory, self.arm.qpos)
        self.way.append(trajectory)
        return self._move(phase, trajectory, guard)

    def _bend_rad(self, phase: Phase) -> float:
        short = max(self.config.close_within_rad, self.config.goal_slack_rad) + _START_SLACK_RAD
        return self.config.bend_rad if phase is Phase.FREE else max(short, self.config.bend_rad)

    def near_grasp(self) -> bool:
        """Check whether the arm stopped close enough to the grasp to close the gripper anyway."""
        error = np.abs(self.arm.qpos - self.plan.approach.qpos[-1]).max()
        return bool(error <= self.config.close_within_rad)

    def retreat(self, motions: int | None = None) -> bool:
        """Go back along the latest motions, by default all; return whether the arm is where the first of them began."""
        for _ in range(len(self.way) if motions is None else motions):
            back = reverse(self.way.pop(), self.arm.qpos)
            if back is not None and not self._move(Phase.RETREAT, back, self.config.retreat_guard):
                return False
        return True

    def give_up(self, what: str, result: PickResult = PickResult.STOPPED) -> ExecutionTrace:
        """Retreat, and end the pick with that result."""
        detail = self.why(what)
        return self.trace(result, self.retreat(), detail)

    def trace(self, result: PickResult, at_home: bool, detail: str) -> ExecutionTrace:
        """Return the record of the pick."""
        if not at_home:
            detail += "; the arm did not get home"
        guard, touch = self.config.approach_guard, None
        stops = [p for p in self.phases if p.phase is Phase.APPROACH and p.stopped_by_contact]
        if guard is not None and stops:
            touch = Touch(tuple(stops[0].qpos.tolist()), stops[0].gripper.width_m, guard.relief_m)
        held, delivered = self.held_after_lift, self.delivered
        return ExecutionTrace(result, tuple(self.phases), held, delivered, at_home, detail, touch)

    def _move(self, phase: Phase, trajectory: Trajectory, guard: ContactGuard | None) -> bool:
        result = self.arm.follow(trajectory, guard)
        touched, state = result.stopped_by_contact, self.gripper.state
        error = np.abs(result.qpos - trajectory.qpos[-1]).max()
        arrived = result.reached or (not touched and bool(error <= self.config.goal_slack_rad))
        self._note(PhaseTrace(phase, trajectory, None, arrived, touched, result.qpos, state, result.detail))
        return arrived

    def _note(self, step: PhaseTrace) -> None:
        self.phases.append(step)
        if self.on_phase is not None:
            self.on_phase(step)

    def why(self, what: str) -> str:
        """Return which motion ended the pick, and how."""
        moves = [p for p in self.phases if p.trajectory is not None and not p.reached]
        words = moves[-1].detail if moves else ""
        how = "stopped by contact" if moves and moves[-1].stopped_by_contact else "did not arrive"
        return f"{what} {how}" + (f": {words}" if words else "")

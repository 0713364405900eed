"""Simulate the arm and gripper: servos that follow commands, and stop on contact."""

import mujoco
import numpy as np
from jaxtyping import Float

from torc.errors import InputError
from torc.records import Trajectory
from torc.robots.description import RobotDescription
from torc.robots.kinematics import tool0_poses
from torc.robots.protocols import ContactGuard, FollowResult, GripperState
from torc.sim.contacts import ContactReader
from torc.sim.stepping import Stepper

_START_TOLERANCE_RAD = 0.1
"""A trajectory must start this close to the arm's position."""
_GOAL_TOLERANCE_RAD = 0.02
_REST_SPEED_RAD_S, _REST_LIMIT_S = 0.02, 0.4
_STUCK_RAD = 0.05
"""An arm that is stuck further than this from its goal stays where it is. Otherwise it would keep pressing, and jump to
the goal unexpectedly once nothing is in its path.
"""
_RELIEF_S = 0.12
_GRIP_LIMIT_S, _GRIP_REST_M_S, _GRIP_HOLD_S = 2.0, 0.002, 0.1
"""Pads slower than this for this long, in which the grip force builds up, have stopped."""
_EMPTY_WIDTH_M = 0.0015
"""If the pads are closed further than this, nothing is between them."""
GripState = tuple[bool, float]
"""The gripper's latest command: whether to close, and the largest actuator force."""


class SimulatedGripper:
    """The `Gripper` of torc.robots.protocols."""

    def __init__(self, stepper: Stepper, robot: RobotDescription) -> None:
        """Take the parts. Raises InputError if the gripper's actuator has no limits, which define how it closes."""
        self._stepper, self._gripper = stepper, robot.gripper
        world = stepper.world
        self._actuator = world.model.actuator(robot.gripper_actuator_name).id
        for limit in ("ctrl", "force"):
            if not getattr(world.model, f"actuator_{limit}limited")[self._actuator]:
                where = f"{robot.mjcf_path}: the actuator '{robot.gripper_actuator_name}'"
                raise InputError(f"{where} needs a {limit}range to be simulated.")
        self._max_force = float(world.model.actuator_forcerange[self._actuator, 1])
        self._tips = [world.model.site(name).id for name in robot.tip_site_names]
        self._base = world.model.body(robot.gripper_body_name).id
        self.closed = False
        """The latest command was to close: whatever touches the fingers is gripped."""

    @property
    def max_width_m(self) -> float:
        return self._gripper.max_width_m

    @property
    def width_m(self) -> float:
        """Distance between the pads."""
        world = self._stepper.world
        mujoco.mj_kinematics(world.model, world.data)
        low, high = world.data.site_xpos[self._tips]
        closing = world.data.xmat[self._base].reshape(3, 3)[:, 0]
        # Pushed apart, the fingers can bend a hair beyond their range.
        return float(np.clip((high - low) @ closing, 0.0, self._gripper.max_width_m))

    @property
    def state(self) -> GripperState:
        """What the gripper feels now."""
        width = self.width_m
        return GripperState(width, self.closed and width > _EMPTY_WIDTH_M)

    def open(self, width_m: float) -> GripperState:
        """Open to width_m. Raises InputError outside the gripper's range."""
        self.begin_opening(width_m)
        return self._run()

    def begin_opening(self, width_m: float) -> None:
        """Start opening, and return at once."""
        ctrl = self._gripper.ctrl(width_m)
        self.closed = False
        self._tell(ctrl, self._max_force)

    def begin_closing(self, force_n: float) -> None:
        """Start closing, and return at once.

        The lever between motor and pads is that of the present width: repeat the command as they close.
        """
        self.closed = True
        command = float(self._stepper.world.model.actuator_ctrlrange[self._actuator, 1])
        force = self._gripper.actuator_force(force_n, self.width_m)
        self._tell(command, min(self._max_force, force))

    def close(self, force_n: float) -> GripperState:
        """Close until contact and keep pressing with force_n per pad, as far as the motor can."""
        if force_n <= 0:
            raise InputError(f"The grip force must be positive, not {force_n} N.")
        # The lever between motor and pads depends on the width, which is known once they rest on the object.
        for _ in range(2):
            self.begin_closing(force_n)
            state = self._run()
        return state

    def save(self) -> GripState:
        """Return the latest command; the rest is in the world's state."""
        force = self._stepper.world.model.actuator_forcerange[self._actuator, 1]
        return self.closed, float(force)

    def restore(self, state: GripState) -> None:
        self.closed, force = state
        self._limit_force(force)

    def _limit_force(self, force: float) -> None:
        # A setting of the model, which the world's saved state does not hold.
        self._stepper.world.model.actuator_forcerange[self._actuator] = -force, force

    def _tell(self, ctrl: float, force: float) -> None:
        self._limit_force(force)
        self._stepper.world.data.ctrl[self._actuator] = ctrl

    def _run(self) -> GripperState:
        elapsed, still = 0.0, 0.0
        chunk = 5 * self._stepper.period_s
        before = self.width_m
        while elapsed < _GRIP_LIMIT_S and still < _GRIP_HOLD_S:
            self._stepper.run(chunk)
            elapsed, now = elapsed + chunk, self.width_m
            still = still + chunk if abs(now - before) < _GRIP_REST_M_S * chunk else 0.0
            before = now
        return self.state


class SimulatedArm:
    """The `Arm` of torc.robots.protocols."""

    def __init__(self, stepper: Stepper, robot: RobotDescription, gripper: SimulatedGripper) -> None:
        self._stepper, self._gripper = stepper, gripper
        model = stepper.world.model
        joints = [model.joint(name) for name in robot.arm.joint_names]
        self._qpos_at = np.array([j.qposadr[0] for j in joints])
        self._qvel_at = np.array([j.dofadr[0] for j in joints])
        self._actuators = np.array([model.actuator(name).id for name in robot.arm_actuator_names])
        self._arm, self._lower, self._upper = robot.arm, robot.arm.lower, robot.arm.upper
        self._contacts = ContactReader(stepper.world, robot)
        # A servo pulls with kp (command - q) - kd qd: leading the command by kd / kp x speed removes its lag.
        kp, kd = model.actuator_gainprm[self._actuators, 0], -model.actuator_biasprm[self._actuators, 2]
        self._lead_s = kd / kp

    @property
    def qpos(self) -> Float[np.ndarray, "dof"]:
        """Joint positions now, radians."""
        return self._stepper.world.data.qpos[self._qpos_at].copy()

    @property
    def contact_n(self) -> float:
        """Force at the hardest contact of arm and gripper now, newtons, except what the closed gripper holds."""
        return float(self._contacts.hardest(ignore_gripped=self._gripper.closed)[0])

    def command(self, qpos: Float[np.ndarray, "dof"]) -> None:
        """Command the servos' positions, and return at once."""
        self._stepper.world.data.ctrl[self._actuators] = np.clip(qpos, self._lower, self._upper)

    def follow(self, trajectory: Trajectory, guard: ContactGuard | None = None) -> FollowResult:
        """Move along the trajectory; with a guard, stop on contact and back off.

        Raises InputError if the trajectory does not start where the arm is, PhysicsError if the simulation broke.
        """
        gap = float(np.abs(trajectory.qpos[0] - self.qpos).max())
        if gap > _START_TOLERANCE_RAD:
            raise InputError(f"The trajectory starts {gap:.2f} rad away from where the arm is.")
        data, taken = self._stepper.world.data, [self.qpos]
        for command in self._commands(trajectory):
            data.ctrl[self._actuators] = command
            self._stepper.step()
            if guard is not None:
                taken.append(self.qpos)
                force, words = self._contacts.hardest(ignore_gripped=self._gripper.closed)
                if force > guard.max_force_n:
                    self._back_off(np.array(taken), guard.relief_m)
                    return FollowResult(False, True, self.qpos, f"{words}, {force:.0f} N")
        return self._come_to_rest(trajectory.qpos[-1])

    def _commands(self, trajectory: Trajectory) -> Float[np.ndarray, "k dof"]:
        """Return servo commands per control period: cubic between the samples, led by the servos' lag."""
        from scipy.interpolate import CubicHermiteSpline

        count = max(1, int(np.ceil(trajectory.duration_s / self._stepper.period_s - 1e-9)))
        times = np.minimum(np.arange(1, count + 1) * self._stepper.period_s, trajectory.times_s[-1])
        if len(trajectory.times_s) < 2:
            return np.repeat(trajectory.qpos[-1:], count, axis=0)
        spline = CubicHermiteSpline(trajectory.times_s, trajectory.qpos, trajectory.qvel)
        commands = spline(times) + self._lead_s * spline(times, 1)
        commands[-1] = trajectory.qpos[-1]
        return np.clip(commands, self._lower, self._upper)

    def _come_to_rest(self, goal: Float[np.ndarray, "dof"]) -> FollowResult:
        data = self._stepper.world.data
        data.ctrl[self._actuators] = np.clip(goal, self._lower, self._upper)
        for _ in range(round(_REST_LIMIT_S / self._stepper.period_s)):
            if np.abs(data.qvel[self._qvel_at]).max() < _REST_SPEED_RAD_S:
                break
            self._stepper.step()
        error = float(np.abs(self.qpos - goal).max())
        if error > _STUCK_RAD:
            data.ctrl[self._actuators] = self.qpos
            self._stepper.run(_RELIEF_S)
            error = float(np.abs(self.qpos - goal).max())
        reached = error <= _GOAL_TOLERANCE_RAD
        detail = "" if reached else f"stopped {error:.3f} rad short of the goal"
        return FollowResult(reached, False, self.qpos, detail)

    def _back_off(self, taken: Float[np.ndarray, "k dof"], relief_m: float) -> None:
        """Go back along the path actually taken, until the flange is relief_m away from where it stopped."""
        flange = tool0_poses(self._arm, taken)[:, :3, 3]
        far = np.flatnonzero(np.linalg.norm(flange - flange[-1], axis=1) >= relief_m)
        start, target = taken[-1], taken[far[-1] if len(far) else 0]
        steps = max(1, round(_RELIEF_S / self._stepper.period_s))
        for s in np.linspace(0.0, 1.0, steps + 1):
            self._stepper.world.data.ctrl[self._actuators] = start + s * (target - start)
            self._stepper.step()
        self._come_to_rest(target)

"""One grasp trial with a gripper that floats: the robot's own 2F-85 on a force-limited carrier, no arm.

The carrier is a mocap body at the flange's grasp pose; the gripper hangs from it by three slides and three hinges
near zero with position actuators, their forces capped about as the arm's are. Commands are therefore displacements
in the flange frame, and no force can exceed the caps, which is what keeps the contact physics sane.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from tools.grasp_model.carry_path import smooth_steps, turned_down
from tools.grasp_model.dataset import Cause
from tools.grasp_model.floating_model import FloatingModel
from torc.errors import PhysicsError
from torc.geometry.transforms import Pose, wxyz_from_rotation


@dataclass(frozen=True)
class TrialConfig:
    """How a trial goes; lengths in metres, times in seconds.

    Attributes:
        standoff_m: the approach starts this far back.
        approach_speed: metres per second.
        stop_force_n: contact force that ends the approach.
        relief_m: how far the gripper then backs off.
        stop_tolerance_m: if stopped closer to the grasp than this, it closes nevertheless.
        settle_s: pause at the grasp before closing.
        close_s: time to close at most.
        closed_s: the fingers count as closed after standing still for this long.
        lift_m, lift_speed: height and speed of the lift.
        grip_force_n: with which each pad presses.
        carry_s, carry_rise_m: duration of the way over the bin, and how far it rises in its middle.
        carry_yaw_rad: turn about the vertical on that way.
        hold_s: rest at the end.
        risen_m: an object is lifted if it has risen this far.
        let_go_s: out of touch with the gripper for this long ends the trial.
        moved_m: other objects count as moved from this distance.
        max_speed: a body faster than this, metres per second, means broken physics.
        control_steps: physics steps per command.
    """

    standoff_m: float = 0.09
    approach_speed: float = 0.15
    stop_force_n: float = 40.0
    relief_m: float = 0.005
    stop_tolerance_m: float = 0.015
    settle_s: float = 0.04
    close_s: float = 0.8
    closed_s: float = 0.1
    lift_m: float = 0.15
    lift_speed: float = 0.2
    grip_force_n: float = 50.0
    carry_s: float = 1.8
    carry_rise_m: float = 0.12
    carry_yaw_rad: float = 0.5
    hold_s: float = 0.3
    risen_m: float = 0.09
    let_go_s: float = 0.15
    moved_m: float = 0.02
    max_speed: float = 6.0
    control_steps: int = 5


@dataclass(frozen=True)
class TrialOutcome:
    """What came of a trial.

    Attributes:
        cause: DELIVERED (between both fingers over the bin) or what went wrong first.
        others_moved: ids of other objects that moved.
        others_dropped: ids of other objects that left the table.
        stopped_short_m: how far before the grasp the approach was stopped; 0 if it was not.
        max_force_n: largest contact force during the approach.
    """

    cause: Cause
    others_moved: tuple[int, ...]
    others_dropped: tuple[int, ...]
    stopped_short_m: float
    max_force_n: float

    @property
    def delivered(self) -> bool:
        """Between both fingers over the bin."""
        return self.cause == Cause.DELIVERED


_STILL = 0.02
"""Speed of the gripper's motor (its own unit, about 1.3 when closing freely) below which it stands still."""


class FloatingGripper:
    """Tries grasps in one settled scene, each from exactly the same state."""

    def __init__(self, floating: FloatingModel, config: TrialConfig | None = None) -> None:
        self._f = floating
        self.config = TrialConfig() if config is None else config
        self.model, self.data = floating.model, mujoco.MjData(floating.model)

    def trial(self, object_id: int, T_world_tcp: Pose, width_m: float) -> TrialOutcome:
        """Approach, close, lift, carry over the bin and hold; deterministic in its arguments.

        Args:
            object_id: the object to be grasped.
            T_world_tcp: grasp pose.
            width_m: distance between the pads when closed on the object.
        """
        run = _Run(self._f, self.data, self.config, object_id)
        run.start(T_world_tcp @ np.linalg.inv(self._f.gripper.T_tool0_tcp(width_m)))
        try:
            cause = run.play()
        except PhysicsError:
            cause = Cause.BROKEN
        moved, dropped = run.others()
        return TrialOutcome(cause, moved, dropped, run.stopped_short_m, run.max_force_n)


class _Run:
    """One trial in progress: commands, guards and early ends."""

    def __init__(
        self, floating: FloatingModel, data: mujoco.MjData, config: TrialConfig, object_id: int
    ) -> None:
        self._f, self._m, self._d, self._c = floating, floating.model, data, config
        self._body = floating.object_bodies[object_id]
        self._id = object_id
        self._dt = floating.model.opt.timestep * config.control_steps
        self.stopped_short_m = 0.0
        self.max_force_n = 0.0

    def start(self, T_world_tool0: Pose) -> None:
        """Restore the settled state and put the open gripper at the start of its approach."""
        mujoco.mj_copyData(self._d, self._m, self._f.settled)
        self._R = T_world_tool0[:3, :3]
        self._d.mocap_pos[0] = T_world_tool0[:3, 3]
        self._d.mocap_quat[0] = wxyz_from_rotation(self._R)
        self._slide = np.array([0.0, 0.0, -self._c.standoff_m])
        self._d.qpos[self._f.carrier_qpos] = [*self._slide, 0, 0, 0]
        self._d.ctrl[self._f.carrier_motors] = [*self._slide, 0, 0, 0]
        self._d.ctrl[self._f.gripper_motor] = 0.0
        self._m.actuator_forcerange[self._f.gripper_motor] = -self._f.max_force, self._f.max_force
        mujoco.mj_forward(self._m, self._d)
        self._positions = self._d.xpos[self._f.object_bodies].copy()
        self._z0 = float(self._d.xpos[self._body, 2])

    def play(self) -> Cause:
        """All phases; raises PhysicsError if a body gets too fast."""
        c = self._c
        if self._starts_inside() or not self._approach():
            return Cause.STOPPED
        self._wait(c.settle_s)
        self._close()
        if not self._between_fingers():
            return Cause.MISSED
        if not self._lift() or not self._risen():
            return Cause.SLIPPED_AT_LIFT
        if not self._over_bin():
            return Cause.SLIPPED_IN_TRANSPORT
        self._wait(c.hold_s)
        return Cause.DELIVERED if self._between_fingers() else Cause.SLIPPED_IN_TRANSPORT

    def others(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Ids of the other objects that moved, and of those that left the table."""
        now = self._d.xpos[self._f.object_bodies]
        far = np.linalg.norm(now - self._positions, axis=1) > self._c.moved_m
        low = now[:, 2] < self._f.support_z_m - 0.02
        far[self._id] = low[self._id] = False
        return tuple(np.flatnonzero(far).tolist()), tuple(np.flatnonzero(low).tolist())

    def _approach(self) -> bool:
        """Straight in until the grasp or a contact; False if stopped too short."""
        c = self._c
        step = c.approach_speed * self._dt
        while self._slide[2] < 0.0:
            self._slide[2] = min(0.0, self._slide[2] + step)
            self._step()
            force = float(np.linalg.norm(self._d.qfrc_constraint[self._f.carrier_dofs[:3]]))
            self.max_force_n = max(self.max_force_n, force)
            if force > c.stop_force_n:
                at = float(self._d.qpos[self._f.carrier_qpos[2]])
                self.stopped_short_m = max(0.0, -at)
                self._slide[2] = min(0.0, at) - c.relief_m
                self._wait(0.1)
                return self.stopped_short_m <= c.stop_tolerance_m
        return True

    def _close(self) -> None:
        """Close until the fingers stand still, then press with the grip force."""
        self._d.ctrl[self._f.gripper_motor] = self._f.closed_command
        self._limit_force(self._f.gripper.max_width_m)
        self._until_still()
        self._limit_force(self._width())
        self._until_still()

    def _until_still(self) -> None:
        motor, still = self._f.gripper_motor, 0
        for k in range(round(self._c.close_s / self._dt)):
            self._step()
            still = still + 1 if k > 10 and abs(self._d.actuator_velocity[motor]) < _STILL else 0
            if still * self._dt >= self._c.closed_s:
                return

    def _limit_force(self, width_m: float) -> None:
        force = min(self._f.max_force, self._f.gripper.actuator_force(self._c.grip_force_n, width_m))
        self._m.actuator_forcerange[self._f.gripper_motor] = -force, force

    def _width(self) -> float:
        """Distance between the pads now, by the gripper's motor."""
        length = float(self._d.actuator_length[self._f.gripper_motor])
        gripper = self._f.gripper
        order = np.argsort(gripper.actuator_lengths)
        return float(np.interp(length, gripper.actuator_lengths[order], gripper.widths_m[order]))

    def _lift(self) -> bool:
        """Straight up; False as soon as the object is let go."""
        up = self._R.T @ np.array([0.0, 0.0, 1.0])
        steps = round(self._c.lift_m / self._c.lift_speed / self._dt)
        return self._carry(up * self._c.lift_m, np.zeros(3), smooth_steps(steps))

    def _over_bin(self) -> bool:
        """To the drop position, gripper pointing down; False as soon as the object is let go."""
        angles, R_end = turned_down(self._R, self._c.carry_yaw_rad)
        T_tool0_tcp = self._f.gripper.T_tool0_tcp(self._width())
        goal = self._f.drop_position - R_end @ T_tool0_tcp[:3, 3]
        here = self._d.mocap_pos[0] + self._R @ self._slide
        rise = self._R.T @ np.array([0.0, 0.0, self._c.carry_rise_m])
        steps = round(self._c.carry_s / self._dt)
        return self._carry(self._R.T @ (goal - here), angles, smooth_steps(steps), rise)

    def _carry(
        self,
        displacement: Float[np.ndarray, "3"],
        angles: Float[np.ndarray, "3"],
        shares: Float[np.ndarray, "k"],
        rise: Float[np.ndarray, "3"] | None = None,
    ) -> bool:
        """Move and turn by these amounts (flange frame at the grasp); False as soon as the object is let go."""
        start, lost = self._slide.copy(), 0
        for k, share in enumerate(shares):
            self._slide = start + share * displacement
            if rise is not None:
                self._slide = self._slide + np.sin(np.pi * share) * rise
            self._d.ctrl[self._f.carrier_motors[3:]] = share * angles
            self._step()
            if k % 2 == 0:
                lost = 0 if any(self._touch()) else lost + 2
                if lost * self._dt > self._c.let_go_s:
                    return False
        return True

    def _wait(self, seconds: float) -> None:
        for _ in range(round(seconds / self._dt)):
            self._step()

    def _step(self) -> None:
        """A few physics steps towards the command, then the watchdog."""
        self._d.ctrl[self._f.carrier_motors[:3]] = self._slide
        mujoco.mj_step(self._m, self._d, self._c.control_steps)
        if np.abs(self._d.qvel[self._f.linear_dofs]).max(initial=0.0) > self._c.max_speed:
            raise PhysicsError("A body got too fast in a grasp trial. The trial does not count.")

    def _starts_inside(self) -> bool:
        """Whether the gripper overlaps something where its approach starts."""
        contact = self._d.contact
        hand = self._f.is_hand_geom[contact.geom].any(axis=1)
        return bool((hand & (contact.dist < -0.002)).any())

    def _touch(self) -> tuple[bool, bool]:
        """Whether each finger touches the object."""
        geoms = self._d.contact.geom
        bodies = self._m.geom_bodyid[geoms]
        mine = bodies == self._body
        other = geoms[:, ::-1]
        left = bool((mine & self._f.is_left_finger_geom[other]).any())
        right = bool((mine & self._f.is_right_finger_geom[other]).any())
        return left, right

    def _between_fingers(self) -> bool:
        return all(self._touch())

    def _risen(self) -> bool:
        return float(self._d.xpos[self._body, 2]) - self._z0 >= self._c.risen_m

"""Check that an arm moves as commanded: a small turn of each joint, and a touch test. A person confirms each motion."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from torc.records import Trajectory
from torc.robots.description import RobotDescription
from torc.robots.execution import reverse
from torc.robots.kinematics import tcp_pose
from torc_lab.calibration.marker import is_calibrated, marker_of_lab
from torc_lab.calibration.touch import ABOVE_M, touch_motion
from torc_lab.checks import turning
from torc_lab.devices import limits
from torc_lab.lab_file import Lab
from torc_lab.person import Ask
from torc_lab.protocols import ArmDriver, RobotStoppedError
from torc_lab.supervisor import SupervisedArm

TURN_RAD = 0.08
"""Angle by which each joint turns: well above encoder noise, and a hand's breadth at arm's length."""
_TURN_S, _SAMPLES = 2.0, 81
_OFF = 0.1
"""Greatest error of any joint, as a share of the turn."""
_MOVED = 0.25
"""A joint that moved by more than this share of the turn counts as moved."""


@dataclass(frozen=True)
class Finding:
    """One result of a check; `good`: the device is as it should be."""

    text: str
    good: bool = True
    device: str = ""


def check_motions(lab: Lab, arm: ArmDriver, ask: Ask) -> Iterator[Finding]:
    """Turn each joint a little and back, and compare all joints with the command at the turning point.

    Ends at the first joint that does not follow. Else the touch test comes last, if the camera was calibrated.

    Args:
        ask: asks the person to confirm a motion; nothing moves without a yes.
    """
    supervised, within = SupervisedArm(arm, lab.robot, limits(lab)), limits(lab)
    names = lab.robot.arm.joint_names
    for joint, name in enumerate(names):
        start, label = supervised.qpos, f"joint {joint + 1} ({name})"
        up = within.upper[joint] - start[joint] > start[joint] - within.lower[joint]
        turn = turning(start, TURN_RAD if up else -TURN_RAD, joint, _TURN_S, _SAMPLES)
        by_rad = turn.qpos[-1, joint] - start[joint]
        if not ask(f"{arm.name}: turn {label} by {by_rad:+.3g} rad and back? {_seen(lab.robot, turn)}"):
            yield Finding(f"{label} was not tried")
            continue
        fault = _turned(supervised, turn, joint, names)
        yield Finding(f"{label} {fault or 'turned as commanded, and back'}", not fault)
        if fault:
            yield Finding("the other joints were not tried: find the cause first", False)
            return
    if is_calibrated(lab):
        yield from _touch(lab, supervised, ask)


def _seen(robot: RobotDescription, turn: Trajectory) -> str:
    """Return where the fingertips should go; only a person can see that a robot is built differently from its model."""
    before, after = (tcp_pose(robot, q, 0.0)[:3, 3] for q in turn.qpos[[0, -1]])
    words = (("forward", "back"), ("to the left", "to the right"), ("up", "down"))
    moved_cm = zip((100 * (after - before)).tolist(), words, strict=True)
    ways = [f"{abs(d):.0f} cm {either[d < 0]}" for d, either in moved_cm if abs(d) >= 0.5]
    return f"The fingertips should {'go ' + ', '.join(ways) if ways else 'stay where they are'}."


def _turned(arm: SupervisedArm, turn: Trajectory, joint: int, names: Sequence[str]) -> str:
    """Turn a joint and back; return what was wrong, "" if nothing."""
    start, by_rad = turn.qpos[0], turn.qpos[-1, joint] - turn.qpos[0, joint]
    try:
        arm.follow(turn)
        stopped = ""
    except RobotStoppedError as error:
        stopped = f"was stopped: {error}"
    if fault := turn_fault(arm.qpos - start, joint, by_rad, names) or stopped:
        return fault
    back = reverse(turn, arm.qpos, slowdown=1.0)
    if back is not None:
        arm.follow(back)
    left_rad = float(np.abs(arm.qpos - start).max())
    return "" if left_rad <= _OFF * abs(by_rad) else f"did not come back: {left_rad:.3f} rad are left"


def turn_fault(moved_rad: Float[np.ndarray, "dof"], joint: int, by_rad: float, names: Sequence[str]) -> str:
    """Return the fault in how the joints moved when only one was commanded; "" if they moved as they should.

    Args:
        moved_rad: by how much each joint moved.
        joint: index of the commanded joint, from 0.
        by_rad: by how much it was commanded to move.
        names: names of the joints.
    """
    share = moved_rad / by_rad
    others = [k for k in range(len(names)) if abs(share[k]) > _MOVED and k != joint]
    listed = ", ".join(f"joint {k + 1} ({names[k]}) by {moved_rad[k]:+.3f} rad" for k in others)
    if abs(share[joint]) < _MOVED:
        return f"did not move; instead moved {listed}" if listed else "did not move"
    if share[joint] < 0:
        return f"turned the wrong way: by {moved_rad[joint]:+.3f} rad instead of {by_rad:+.3f}"
    if abs(share[joint] - 1) > _OFF:
        return f"turned by {moved_rad[joint]:+.3f} rad instead of {by_rad:+.3f}"
    along = [k for k in range(len(names)) if abs(share[k]) > _OFF and k != joint]
    if along:
        return "turned as commanded, and along with it " + ", ".join(
            f"joint {k + 1} ({names[k]})" for k in along
        )
    return ""


def _touch(lab: Lab, arm: SupervisedArm, ask: Ask) -> Iterator[Finding]:
    """Carry out the touch test, which checks camera pose, base and robot description together."""
    marker = marker_of_lab(lab)
    if marker is None:
        return
    motion = touch_motion(lab, marker, arm.qpos)
    if motion is None:
        yield Finding("the marker cannot be reached from above: no touch test. Tape it nearer to the arm")
        return
    above = f"{100 * ABOVE_M:.0f} cm above the middle of the marker"
    if not ask(f"Touch test. Clear the table and open the gripper. Bring the fingertips to {above}?"):
        yield Finding("the touch test was not made")
        return
    arm.follow(motion)
    if ask(f"Are the fingertips {above}, to within 1 cm?"):
        yield Finding("the fingertips came to where the calibration has the marker")
    else:
        yield Finding(
            "the fingertips are not where the calibration has the marker: the camera's pose, the place of the robot's "
            "base in the world frame, or the robot description is wrong",
            False,
        )
    back = reverse(motion, arm.qpos)
    if back is not None and ask("Go back?"):
        arm.follow(back)

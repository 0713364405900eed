"""Whether an arm does what it is commanded: each joint a little, and a touch test; a person lets every motion go."""

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
from torc_lab.devices import limits
from torc_lab.finding import Finding
from torc_lab.lab_file import Lab
from torc_lab.person import Ask
from torc_lab.protocols import ArmDriver, RobotStoppedError
from torc_lab.supervisor import SupervisedArm

TURN_RAD = 0.08
"""Each joint turns by this: well above the noise of encoders, and a hand's breadth at arm's length."""
_TURN_S, _SAMPLES = 2.0, 81
_OFF = 0.1
"""Share of the turn by which a joint, or another one, may be off."""
_MOVED = 0.25
"""Share of the turn from which on a joint has moved."""


def check_motions(lab: Lab, arm: ArmDriver, ask: Ask) -> Iterator[Finding]:
    """Turns each joint a little and back, compares where every joint is at the turning point with the command, and ends
    at the first that does something else. Then the touch test, if the camera was calibrated.
    """
    supervised = SupervisedArm(arm, lab.robot, limits(lab))
    names = lab.robot.arm.joint_names
    for joint, name in enumerate(names):
        turn = _Turn(lab.robot, supervised.qpos, joint, _direction(lab, supervised.qpos, joint))
        if not ask(
            f"{arm.name}: turn joint {joint + 1} ({name}) by {turn.by_rad:+g} rad and back? {turn.text}"
        ):
            yield Finding("arm", True, f"joint {joint + 1} was not tried")
            continue
        fault = _turned(supervised, turn, names)
        yield Finding(
            "arm", not fault, f"joint {joint + 1} ({name}) " + (fault or "turned as commanded, and back")
        )
        if fault:
            yield Finding("arm", False, "the other joints were not tried: find the cause first")
            return
    if is_calibrated(lab):
        yield from _touch(lab, supervised, ask)


@dataclass(frozen=True)
class _Turn:
    """One joint turns from where the arm is."""

    robot: RobotDescription
    start: Float[np.ndarray, "dof"]
    joint: int
    by_rad: float

    @property
    def there(self) -> Trajectory:
        """From rest to rest."""
        t = np.linspace(0, _TURN_S, _SAMPLES)
        s = t / _TURN_S
        path, rates = np.tile(self.start, (len(t), 1)), np.zeros((len(t), len(self.start)))
        path[:, self.joint] += self.by_rad * (3 * s**2 - 2 * s**3)
        rates[:, self.joint] = self.by_rad * 6 * s * (1 - s) / _TURN_S
        return Trajectory(t, path, rates)

    @property
    def text(self) -> str:
        """Where the fingertips should go: whether a robot is built otherwise only a person can see."""
        before, after = (tcp_pose(self.robot, q, 0.0)[:3, 3] for q in self.there.qpos[[0, -1]])
        dx, dy, dz = (100 * (after - before)).tolist()
        ways = [
            f"{abs(d):.0f} cm {words[d < 0]}"
            for d, words in (
                (dx, ("forward", "back")),
                (dy, ("to the left", "to the right")),
                (dz, ("up", "down")),
            )
            if abs(d) >= 0.5
        ]
        return (
            f"The fingertips should go {', '.join(ways)}."
            if ways
            else "The fingertips should stay where they are."
        )


def _direction(lab: Lab, qpos: Float[np.ndarray, "dof"], joint: int) -> float:
    """Away from the nearer joint limit."""
    within = limits(lab)
    return TURN_RAD if within.upper[joint] - qpos[joint] > qpos[joint] - within.lower[joint] else -TURN_RAD


def _turned(arm: SupervisedArm, turn: _Turn, names: Sequence[str]) -> str:
    """What was wrong with a turn there and back; "" for nothing."""
    try:
        arm.follow(turn.there)
        stopped = ""
    except RobotStoppedError as error:
        stopped = str(error)
    fault = turn_fault(arm.qpos - turn.start, turn.joint, turn.by_rad, names)
    if fault or stopped:
        return fault or f"was stopped: {stopped}"
    back = reverse(turn.there, arm.qpos, slowdown=1.0)
    if back is not None:
        arm.follow(back)
    left_rad = float(np.abs(arm.qpos - turn.start).max())
    return "" if left_rad <= _OFF * abs(turn.by_rad) else f"did not come back: {left_rad:.3f} rad are left"


def turn_fault(moved_rad: Float[np.ndarray, "dof"], joint: int, by_rad: float, names: Sequence[str]) -> str:
    """What is wrong with how the joints moved when one of them was commanded; "" for nothing."""
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
    """The touch test. It tries camera pose, base and robot description together."""
    marker = marker_of_lab(lab)
    if marker is None:
        return
    motion = touch_motion(lab, marker, arm.qpos)
    if motion is None:
        yield Finding(
            "arm", True, "the marker cannot be reached from above: no touch test. Tape it nearer to the arm"
        )
        return
    if not ask(
        f"Touch test. Clear the table and open the gripper. Bring the fingertips to {100 * ABOVE_M:.0f} cm above the "
        "marker's middle?"
    ):
        yield Finding("arm", True, "the touch test was not made")
        return
    arm.follow(motion)
    good = ask(f"Are the fingertips {100 * ABOVE_M:.0f} cm above the middle of the marker, to within 1 cm?")
    yield Finding(
        "arm",
        good,
        "the fingertips came to where the calibration has the marker"
        if good
        else "the fingertips are not where the calibration has the marker: the camera's pose, the place of the robot's "
        "base in the world frame, or the robot description is wrong",
    )
    back = reverse(motion, arm.qpos)
    if back is not None and ask("Go back?"):
        arm.follow(back)

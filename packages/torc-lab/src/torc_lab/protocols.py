"""What a driver of a real arm must do. It moves nothing on its own, and judges nothing: `torc_lab.supervisor` does."""

import inspect
import time
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from torc import TorcError
from torc.errors import PickHaltedError
from torc.records import Trajectory
from torc.robots.protocols import Gripper

AT_ONCE_S = 0.05
"""A method that does not wait returns within this time."""
_LOOKS, _APART_S = 40, 0.01


class LabError(TorcError):
    """A device of the laboratory cannot be reached, is silent, or refuses. Whatever was going on has no result: a trial
    is errored, no pick failed."""


class MotionRefusedError(LabError, PickHaltedError):
    """The supervisor did not let a motion begin."""


class RobotStoppedError(LabError, PickHaltedError):
    """A motion was stopped halfway, by the robot, the supervisor or a person. The arm rests; somebody has to look, and
    to say `resume`."""


@dataclass(frozen=True)
class ArmStatus:
    """What the controller said last.

    Attributes:
        stamp_s: when that came in, by `time.monotonic`.
        qpos: joint positions, radians, in the order of the robot description.
        moving: the controller says that the arm moves.
        stopped: why the controller lets nothing move: e-stop, protective stop, mode, drives off, error; "" if it does.
        contact_n: force on arm and gripper beyond that at the start of the motion, newtons; infinite for a driver that
            feels contacts, but not how strong they are; 0 for one that feels none.
    """

    stamp_s: float
    qpos: Float[np.ndarray, "dof"]
    moving: bool
    stopped: str = ""
    contact_n: float = 0.0


@runtime_checkable
class ArmDriver(Protocol):
    """A connection to one arm. To connect opens nothing on which a motion could start: the first `start`, or `enable`,
    does. No method waits for a motion. All raise LabError once the connection is lost; it is not made again, so that
    nothing is sent after a reconnection.
    """

    @property
    def name(self) -> str:
        """For messages, e.g. "UR5e at 192.168.1.10"."""

    @property
    def feels_contact(self) -> bool:
        """Whether `ArmStatus.contact_n` means anything."""

    @property
    def start_tolerance_rad(self) -> float:
        """A trajectory must start this close to where the arm is, in every joint, or the controller refuses it."""

    def status(self) -> ArmStatus:
        """The latest status that came in; never waits."""

    def start(self, trajectory: Trajectory) -> None:
        """Hands a whole trajectory to the controller and returns. Raises LabError if it was refused."""

    def ended(self) -> str | None:
        """None while the controller carries out the latest trajectory; "" once it says that it is done; else why it
        ended early. What it says is checked against where the arm is.
        """

    def stop(self) -> None:
        """Makes the arm stop as fast as it safely can; may be called at any time, also twice, and from a handler of a
        signal. Returns at once.
        """

    def close(self) -> None:
        """Ends the connection."""


@runtime_checkable
class PowersServos(Protocol):
    """An arm driver that can switch the servos on."""

    def enable(self) -> None:
        """Powers the servos and lets motions in. **The brakes open.** Raises LabError with the controller's reason."""


@runtime_checkable
class SeesOtherJoints(Protocol):
    """An arm driver whose controller reports joints that are not the arm's, such as a torso's."""

    def other_joints(self) -> Mapping[str, float]:
        """Their positions, radians, by name; "group N" on a Motoman controller. Never waits. Raises LabError."""


@runtime_checkable
class GripperDriver(Gripper, Protocol):
    """A connection to one gripper: a `Gripper` whose `close` closes the fingers, and whose connection `disconnect`
    ends.
    """

    def disconnect(self) -> None:
        """Ends the connection; the fingers keep their grip."""


@runtime_checkable
class NeedsActivation(Protocol):
    """A gripper driver whose device must be activated after power-up."""

    @property
    def ready(self) -> bool:
        """Whether it was activated since it got power."""

    def activate(self) -> None:
        """Activates it: **the fingers move all the way**. Raises LabError if it does not get ready."""


def missing_methods(device: object, protocol: type) -> list[str]:
    """Members of a protocol that a device lacks, found without calling any of its code."""
    members = [name for part in protocol.__mro__ for name in vars(part) if not name.startswith("_")]
    return [name for name in members if inspect.getattr_static(device, name, _ABSENT) is _ABSENT]


_ABSENT = object()


def state_faults(driver: ArmDriver) -> list[str]:
    """Rules that a driver with all methods breaks by what it says of its state while nothing moves. `torc lab check`
    looks first whether it does.
    """
    found = []
    if not driver.name or not driver.start_tolerance_rad > 0:
        found.append("it has no name, or a start tolerance that is not above 0")
    stamps, slowest, ahead_s = [], 0.0, 0.0
    for _ in range(_LOOKS):
        began = time.monotonic()
        status = driver.status()
        if not isinstance(status, ArmStatus):
            return [f"status() returned a {type(status).__name__}; it must be a torc_lab.protocols.ArmStatus"]
        now = time.monotonic()
        slowest, ahead_s = max(slowest, now - began), max(ahead_s, status.stamp_s - now)
        stamps.append(status.stamp_s)
        time.sleep(_APART_S)
    if ahead_s > 0:
        found.append(f"its states are {ahead_s:.1f} s in the future: stamp_s is by time.monotonic()")
    if slowest > AT_ONCE_S:
        found.append(f"status() waited {slowest:.2f} s; it must return what came last")
    if any(b < a for a, b in pairwise(stamps)) or len(set(stamps)) < 4:
        found.append("its stamps stand still, or run backwards")
    if np.ndim(status.qpos) != 1 or not np.isfinite(status.qpos).all():
        found.append("qpos must be one finite number per joint")
    if not driver.feels_contact and status.contact_n:
        found.append("it feels no contact, and reports one")
    if driver.ended() != "":
        found.append("ended() must be '' before the first motion")
    return found

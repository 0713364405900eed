"""The protocols of drivers of real arms and grippers.

A driver moves nothing on its own and judges nothing: `torc_lab.supervisor` does.
"""

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
    """A device of the laboratory cannot be reached, does not answer, or refuses.

    A trial is then errored and has no result; it is not a failed pick.
    """


class MotionRefusedError(LabError, PickHaltedError):
    """The supervisor did not let a motion begin."""


class RobotStoppedError(LabError, PickHaltedError):
    """The robot, the supervisor or a person stopped a motion halfway.

    The arm rests; a person must look, and confirm with `resume`.
    """


@dataclass(frozen=True)
class ArmStatus:
    """The controller's latest state.

    Attributes:
        stamp_s: when it arrived, by `time.monotonic`.
        qpos: joint positions, radians, in the order of the robot description.
        moving: the controller reports that the arm moves.
        stopped: why the controller lets nothing move: e-stop, protective stop, mode, drives off, error; "" if it does.
        contact_n: force on arm and gripper beyond that at the start of the motion, newtons; infinite for a driver that
            feels contacts but not their force; 0 for one that feels none.
    """

    stamp_s: float
    qpos: Float[np.ndarray, "dof"]
    moving: bool
    stopped: str = ""
    contact_n: float = 0.0


@runtime_checkable
class ArmDriver(Protocol):
    """A connection to one arm.

    Connecting opens nothing on which a motion could start; the first `start` or `enable` does. No method waits for a
    motion. All raise LabError once the connection is lost; it is not made again, so that nothing is sent after a
    reconnection.
    """

    @property
    def name(self) -> str:
        """Name for messages, e.g. "UR5e at 192.168.1.10"."""

    @property
    def feels_contact(self) -> bool:
        """Whether `ArmStatus.contact_n` is measured."""

    @property
    def start_tolerance_rad(self) -> float:
        """Largest distance of a trajectory's start from the arm, per joint, that the controller accepts."""

    def status(self) -> ArmStatus:
        """Return the latest status that arrived; never wait."""

    def start(self, trajectory: Trajectory) -> None:
        """Hand a whole trajectory to the controller and return. Raises LabError if it was refused."""

    def ended(self) -> str | None:
        """Return None during the latest trajectory, "" once the controller reports its end, else why it ended early.

        The caller checks this against the arm's position.
        """

    def stop(self) -> None:
        """Stop the arm as fast as it safely can, and return at once.

        May be called at any time, also twice, and from a signal handler.
        """

    def close(self) -> None:
        """End the connection."""


@runtime_checkable
class PowersServos(Protocol):
    """An arm driver that can switch the servos on."""

    def enable(self) -> None:
        """Power the servos and let motions in. **The brakes open.** Raises LabError with the controller's reason."""


@runtime_checkable
class SeesOtherJoints(Protocol):
    """An arm driver whose controller also reports joints outside the arm, such as a torso's."""

    def other_joints(self) -> Mapping[str, float]:
        """Return their positions, radians, by name; "group N" on a Motoman controller. Never waits. Raises LabError."""


@runtime_checkable
class GripperDriver(Gripper, Protocol):
    """A connection to one gripper: a `Gripper` whose `close` closes the fingers; `disconnect` ends the connection."""

    def disconnect(self) -> None:
        """End the connection; the fingers keep their grip."""


@runtime_checkable
class NeedsActivation(Protocol):
    """A gripper driver whose device must be activated after power-up."""

    @property
    def ready(self) -> bool:
        """Whether it has been activated since power-up."""

    def activate(self) -> None:
        """Activate it: **the fingers move all the way**. Raises LabError if it does not become ready."""


def missing_methods(device: object, protocol: type) -> list[str]:
    """Return the members of a protocol that a device lacks, without calling any of its code."""
    members = [name for part in protocol.__mro__ for name in vars(part) if not name.startswith("_")]
    return [name for name in members if inspect.getattr_static(device, name, _ABSENT) is _ABSENT]


_ABSENT = object()


def state_faults(driver: ArmDriver) -> list[str]:
    """Return the rules that a driver's reported state breaks while nothing moves; it must have all methods.

    `torc lab check` first checks that it has.
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

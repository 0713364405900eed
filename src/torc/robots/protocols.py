"""The protocols of robots. The simulator, drivers of real hardware and the tests' fakes implement them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from torc.records import Capture, Observation, PickOutcome, PickPlan, Trajectory
from torc.robots.description import RobotDescription


@dataclass(frozen=True)
class ContactGuard:
    """When a motion must stop because the robot touches something; an object held between the pads does not count.

    Attributes:
        max_force_n: stop as soon as the contact force on the arm or gripper exceeds this. 40 N stops before a stiff arm
            breaks a pile apart; below 15 N a light brush already stops it.
        relief_m: after the stop, go back along the path by this much, so that nothing stays pressed.
    """

    max_force_n: float = 40.0
    relief_m: float = 0.005


@dataclass(frozen=True)
class FollowResult:
    """How a motion ended; `stopped_by_contact`: by a ContactGuard; `detail`: for people, e.g. what was touched."""

    reached: bool
    stopped_by_contact: bool
    qpos: Float[np.ndarray, "dof"]
    detail: str = ""


@dataclass(frozen=True)
class GripperState:
    """What the gripper feels.

    Attributes:
        width_m: distance between the pads.
        holding: something is between them: they stopped on contact before they were closed.
    """

    width_m: float
    holding: bool


HeldCheck = Callable[[Observation, float], bool]
"""Returns whether the gripper holds the target, given a snapshot with the arm at rest after the lift, and the gripper's
opening.
"""


@runtime_checkable
class Camera(Protocol):
    """Takes RGB-D snapshots."""

    def capture(self) -> Observation | Capture:
        """Return one snapshot, taken now; as a Capture if the true masks are known, as in a simulation."""


@runtime_checkable
class Arm(Protocol):
    """Follows trajectories."""

    @property
    def qpos(self) -> Float[np.ndarray, "dof"]:
        """Joint positions now, radians."""

    def follow(self, trajectory: Trajectory, guard: ContactGuard | None = None) -> FollowResult:
        """Move along the trajectory, which starts where the arm is; return when the arm rests again.

        Only with a guard the motion stops on contact and backs off by guard.relief_m.
        """


@runtime_checkable
class Gripper(Protocol):
    """Opens and closes; reports what it holds."""

    @property
    def max_width_m(self) -> float:
        """Largest opening between the pads."""

    def open(self, width_m: float) -> GripperState:
        """Open (or close) the pads to width_m without force; return when they rest."""

    def close(self, force_n: float) -> GripperState:
        """Close until contact or the end of travel, and keep pressing with force_n."""

    @property
    def state(self) -> GripperState:
        """What the gripper feels now."""


@runtime_checkable
class Robot(Protocol):
    """A whole robot: looks, and carries out picks."""

    @property
    def description(self) -> RobotDescription:
        """Kinematics and shape."""

    def capture(self) -> Observation | Capture:
        """Return one snapshot with the arm at rest; as a Capture if the true masks are known."""

    def execute(self, plan: PickPlan, is_target: HeldCheck | None = None) -> PickOutcome:
        """Carry out one pick; the arm is at rest again afterwards.

        Args:
            plan: the motions.
            is_target: asked after a lift with something in the hand; without it, the plan's `is_target` decides.

        Raises PickHaltedError if the robot was stopped, PhysicsError or another TorcError if it broke.
        """


@runtime_checkable
class KnowsObjects(Protocol):
    """A robot that numbers the objects itself, as a simulator does."""

    def aim_at(self, true_id: int | None) -> None:
        """Note which object, by its own ids, the next pick is meant for; None if the plan's id is one of its own."""

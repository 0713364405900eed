"""One grasp, and everything that its motions depend on."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from torc.collision.collision_world import CollisionWorld
from torc.collision.contacts import Contacts, blockers, collides, self_contacts, static_contacts
from torc.collision.placement import RobotArrays
from torc.geometry.transforms import invert
from torc.motion.holding import Held
from torc.robots.description import ArmDescription, RobotDescription


@dataclass(frozen=True)
class LineContext:
    """One grasp, and everything that its motions depend on.

    Attributes:
        arm, robot: the arm, and the robot for the compiled checks.
        world: obstacles.
        opening_m: of the gripper before it closes.
        own_id: the object to be grasped.
        T_world_tool0: the flange at the grasp.
        approach_axis: direction of the approach, world frame.
        width_m: of the closed gripper.
        hold: returns the object once it is in the hand, in the tool0 frame; called when first needed.
    """

    arm: ArmDescription
    robot: RobotArrays
    world: CollisionWorld
    opening_m: float
    own_id: int
    T_world_tool0: Float[np.ndarray, "4 4"]
    approach_axis: Float[np.ndarray, "3"]
    width_m: float
    hold: Callable[[], Held]

    @cached_property
    def held(self) -> Held:
        """The object once it is in the hand, in the tool0 frame."""
        return self.hold()

    def contacts(self, qpos: Float[np.ndarray, "n dof"]) -> Contacts:
        """Return the contacts, leaving out the object to be grasped."""
        return blockers(self.world, self.robot, qpos, self.opening_m, self.own_id)

    def free_when_lifted(self, qpos: Float[np.ndarray, "n dof"]) -> Bool[np.ndarray, "n"]:
        """Check whether nothing is touched with the object in the hand, however far it may reach."""
        return ~collides(self.without_object, self.robot, qpos, self.width_m, attached=self.held.possible)

    @cached_property
    def without_object(self) -> CollisionWorld:
        """The world once the object is in the hand, with what it hid as free."""
        return self.world.without_object(self.own_id)

    def hits_fixed(self, qpos: Float[np.ndarray, "n dof"]) -> bool:
        """Check whether table, bin or the robot itself is touched anywhere."""
        return bool(np.any(static_contacts(self.world, self.robot, qpos, self.opening_m)))

    def hits_robot_when_held(self, qpos: Float[np.ndarray, "n dof"]) -> bool:
        """Check whether the visible part of the object in the hand touches the robot anywhere."""
        return bool(np.any(self_contacts(self.world, self.robot, qpos, self.width_m, self.held.seen)))


def line_context(
    robot: RobotDescription,
    arrays: RobotArrays,
    world: CollisionWorld,
    opening_m: float,
    own_id: int,
    T_world_tcp: Float[np.ndarray, "4 4"],
    width_m: float,
    held_in_world: Callable[[], Held],
) -> LineContext:
    """Build the context of a grasp with the pads width_m apart, clipped to the gripper's range.

    `held_in_world` returns the object where it is, world frame; the rest as in LineContext.
    """
    width_m = float(np.clip(width_m, 0.0, robot.gripper.max_width_m))
    T_world_tcp = T_world_tcp.astype(float)
    T_world_tool0 = T_world_tcp @ invert(robot.gripper.T_tool0_tcp(width_m))

    def hold() -> Held:
        return held_in_world().moved(invert(T_world_tool0))

    approach_axis = T_world_tcp[:3, 2]
    return LineContext(
        robot.arm, arrays, world, opening_m, own_id, T_world_tool0, approach_axis, width_m, hold
    )

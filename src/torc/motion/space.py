"""The query for a free motion, and its free space, ready for the compiled checks."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from torc.collision.collision_world import CollisionWorld
from torc.collision.contact_kernels import edges_batch
from torc.collision.contacts import contacts_each, with_attached, world_arrays
from torc.collision.obstacles import WorldArrays
from torc.collision.placement import RobotArrays, joint_reach
from torc.geometry.transforms import kernel_array
from torc.robots.description import Qpos

_BATCH = 24
"""Goals that are checked at once."""


@dataclass(frozen=True)
class FreeSpace:
    """Where the arm may be.

    Attributes:
        robot: with whatever is attached.
        world: obstacles.
        width_m: opening of the gripper.
        reach: see `joint_reach`.
        step_m: see CollisionConfig.edge_step_m.
        lower, upper: joint limits, radians.
        weights: seconds per radian of each joint at full speed: joint distances are measured in time.
    """

    robot: RobotArrays
    world: WorldArrays
    width_m: float
    reach: Float[np.ndarray, "dof links"]
    step_m: float
    lower: Qpos
    upper: Qpos
    weights: Float[np.ndarray, "dof"]

    @property
    def scene(self) -> tuple[float, RobotArrays, WorldArrays, np.ndarray, float]:
        """Opening, robot, world, reach and step, in the order that the compiled checks expect."""
        return self.width_m, self.robot, self.world, self.reach, self.step_m

    def collides(self, qpos: Float[np.ndarray, "n dof"]) -> Bool[np.ndarray, "n"]:
        """Check whether each configuration touches anything."""
        n = len(qpos)
        widths_m, own_bits = np.full(n, self.width_m), np.zeros(n, np.uint64)
        bits, flags = contacts_each(kernel_array(qpos), widths_m, own_bits, self.robot, self.world)
        return (bits != 0) | (flags != 0)

    def edges_collide(
        self, starts: Float[np.ndarray, "*m dof"], ends: Float[np.ndarray, "n dof"]
    ) -> Bool[np.ndarray, "n"]:
        """Check whether each straight edge touches anything; `starts` may be one for all."""
        n = len(ends)
        width_m, *scene = self.scene
        starts = kernel_array(np.broadcast_to(starts, ends.shape))
        return edges_batch(starts, kernel_array(ends), np.full(n, width_m), np.zeros(n, np.uint64), *scene)

    def edge_free(self, a: Qpos, b: Qpos) -> bool:
        """Check whether the straight edge touches nothing."""
        return not self.edges_collide(a, b[None])[0]

    def seconds_between(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the time the slowest joint needs at full speed, ignoring accelerations."""
        return np.max(np.abs(np.asarray(b) - a) * self.weights, axis=-1)


def free_space(
    robot: RobotArrays,
    world: CollisionWorld,
    width_m: float,
    limits: tuple[np.ndarray, np.ndarray],
    max_speed: Float[np.ndarray, "dof"],
    attached: Float[np.ndarray, "a 4"] | None = None,
) -> FreeSpace:
    """Build the free space of a robot in a world, within joint limits (lower, upper).

    `attached`: spheres (x, y, z, radius) that move with the gripper, tool0 frame.
    """
    robot, width_m = with_attached(robot, attached), float(width_m)
    reach, step_m = joint_reach(robot, width_m), world.config.edge_step_m
    lower, upper = limits
    return FreeSpace(robot, world_arrays(world), width_m, reach, step_m, lower, upper, 1.0 / max_speed)


def loosened(space: FreeSpace, by_m: float, itself_too: bool = False) -> FreeSpace:
    """Return the space with smaller paddings, with `itself_too` also between parts of the robot."""
    world = space.world._replace(padding=space.world.padding - by_m)
    if itself_too:
        world = world._replace(self_padding=world.self_padding - by_m)
    return replace(space, world=world)


def grown(space: FreeSpace, by_m: Float[np.ndarray, "b"]) -> FreeSpace:
    """Return the space with each fixed box larger by by_m on all sides."""
    boxes = space.world.boxes + np.outer(by_m, (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0))
    return replace(space, world=space.world._replace(boxes=boxes))


@dataclass(frozen=True)
class MotionQuery:
    """The ends of a motion, and the free space between them.

    Attributes:
        space: what must not be touched.
        start: configuration to start from, radians.
        goals: configurations to end in, any of them.
        later_s: seconds that the choice of each goal costs later; None if they all cost the same.
    """

    space: FreeSpace
    start: Qpos
    goals: Float[np.ndarray, "g dof"]
    later_s: Float[np.ndarray, "g"] | None = None

    def among(self, index: Int[np.ndarray, "k"]) -> "MotionQuery":
        """Return the query with only some of the goals."""
        later_s = None if self.later_s is None else self.later_s[index]
        return replace(self, goals=self.goals[index], later_s=later_s)

    def with_room(self, room_m: float) -> "MotionQuery":
        """Return the query with more room to all fixed boxes.

        Boxes near the start, or near a goal that can be reached, get half of that, or none.
        """
        goals = self.goals[~self.space.collides(self.goals)]
        ends = np.vstack([self.start, goals])

        def near(by_m: Float[np.ndarray, "b"]) -> bool:
            return bool(grown(self.space, by_m).collides(ends).any())

        each = np.eye(len(self.space.world.boxes))
        by_m = room_m * each.sum(axis=0)
        if near(by_m):
            shares = [next((s for s in (1.0, 0.5) if not near(s * room_m * box)), 0.0) for box in each]
            by_m = room_m * np.array(shares)
        return replace(self, space=grown(self.space, by_m))

    def soonest_free(self, most: int) -> Int[np.ndarray, "k"]:
        """Return indices of the `most` soonest free goals, or fewer, in order; later ones are hardly checked."""
        by_time, free = self.by_time(), np.zeros(0, int)
        for batch in (by_time[i : i + _BATCH] for i in range(0, len(by_time), _BATCH)):
            free = np.append(free, batch[~self.space.collides(self.goals[batch])])
            if len(free) >= most:
                break
        return free[:most]

    def by_time(self) -> Int[np.ndarray, "g"]:
        """Return indices of the goals, the soonest first."""
        seconds = self.space.seconds_between(self.start, self.goals)
        return np.argsort(seconds if self.later_s is None else seconds + self.later_s, kind="stable")

"""Check arm configurations against a collision world in batches."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, UInt64

from torc.collision.collision_world import CollisionWorld
from torc.collision.contact_kernels import contacts_batch
from torc.collision.obstacles import SELF, STATIC, WorldArrays, clear_touched
from torc.collision.placement import RobotArrays, place_spheres, scratch_for
from torc.errors import InputError
from torc.geometry.transforms import kernel_array
from torc.parallel import by_rows
from torc.robots.description import Qpos, RobotDescription

AnyRobot = RobotDescription | RobotArrays
"""A description, or its arrays from `robot_arrays` for frequent calls."""
Qposes = Float[np.ndarray, "n dof"]
"""Configurations, radians."""
Widths = Float[np.ndarray, "n"] | float
"""Openings of the gripper: one each, or one for all."""
Spheres = Float[np.ndarray, "a 4"]
"""x, y, z, radius."""


@dataclass(frozen=True)
class Contacts:
    """What each configuration touches.

    Attributes:
        bits: objects touched, bit k for object id k. The own object's bit is set where an arm link (not the
            gripper) touches its surface.
        static: touches table, bin, or voxels that belong to no object.
        self_collision: touches the robot itself: its own arm, torso, other arm.
    """

    bits: UInt64[np.ndarray, "n"]
    static: Bool[np.ndarray, "n"]
    self_collision: Bool[np.ndarray, "n"]

    @property
    def free(self) -> Bool[np.ndarray, "n"]:
        """True where nothing at all is touched."""
        return (self.bits == 0) & ~self.static & ~self.self_collision


def blockers(
    world: CollisionWorld, robot: AnyRobot, qpos: Qposes, width_m: Widths, own_id: np.ndarray | int
) -> Contacts:
    """Return everything that arm and gripper touch at each configuration.

    The own object (the one to be grasped) counts less: voxels that it hides are ignored, its surface voxels are ignored
    for palm and fingers but not for the arm's links. Unknown voxels hidden by nothing that has an id, surface of no
    object, table and bin are static.

    A configuration with NaN is reported as static and self collision. `own_id`: negative for none.
    """
    bits, flags = _touched(world, _arrays(robot), qpos, width_m, own_id, first_only=False)
    return Contacts(bits, (flags & STATIC) != 0, (flags & SELF) != 0)


def static_contacts(
    world: CollisionWorld, robot: AnyRobot, qpos: Qposes, width_m: Widths
) -> Bool[np.ndarray, "n"]:
    """Check whether each configuration touches table, bin or the robot itself; voxels are ignored."""
    return _touched(world, _arrays(robot), qpos, width_m, voxels_too=False)[1] != 0


def self_contacts(
    world: CollisionWorld, robot: AnyRobot, qpos: Qposes, width_m: Widths, attached: Spheres | None = None
) -> Bool[np.ndarray, "n"]:
    """Check whether the robot, with attached spheres (see `collides`), touches itself at each configuration."""
    arrays = with_attached(_arrays(robot), attached)
    return (_touched(world, arrays, qpos, width_m, first_only=False, voxels_too=False)[1] & SELF) != 0


def attached_contacts(
    world: CollisionWorld, robot: AnyRobot, qpos: Qpos, width_m: float, attached: Spheres
) -> Bool[np.ndarray, "a"]:
    """Return which attached spheres (see `collides`) touch table, bin or the robot at one configuration.

    Voxels are ignored. All spheres count as touching if the robot itself touches one of these.
    """
    arrays = _arrays(robot)  # a robot per sphere: rarely needed
    touching = [
        static_contacts(world, with_attached(arrays, sphere[None]), qpos[None], width_m)[0]
        for sphere in attached
    ]
    return np.array(touching, dtype=bool)


def collides(
    world: CollisionWorld,
    robot: AnyRobot,
    qpos: Qposes,
    width_m: Widths,
    ignore_id: int = -1,
    attached: Spheres | None = None,
) -> Bool[np.ndarray, "n"]:
    """Check whether each configuration touches anything; `ignore_id` as own_id of `blockers`.

    `attached`: spheres (x, y, z, radius) in the tool0 frame that move with the gripper, e.g. a held object. Like the
    gripper, they ignore the voxels of ignore_id. They must not touch the robot itself either.
    """
    bits, flags = _touched(world, with_attached(_arrays(robot), attached), qpos, width_m, ignore_id)
    return (bits != 0) | (flags != 0)


def carved(
    world: CollisionWorld,
    robot: AnyRobot,
    qpos: Qpos,
    width_m: float,
    margin_m: float = 0.0,
    attached: Spheres | None = None,
    only_id: int = -1,
) -> CollisionWorld:
    """Return the world without the voxels that the robot touches where it is known, or allowed, to be.

    It is grown by its paddings and the margin, attached spheres by half of that: they are already larger than what they
    stand for. `only_id`: remove only this object's voxels; negative for all.
    """
    arrays = with_attached(_arrays(robot), attached)
    q, only = kernel_array(qpos), _bits_of(np.array([only_id]))
    dof, scratch = len(q), scratch_for(arrays)
    place_spheres(q, float(width_m), arrays, scratch)
    link = np.repeat(np.arange(len(arrays.link_start) - 1), np.diff(arrays.link_start))
    c = world.config
    growth = np.select(
        [link < dof, link < dof + 3],
        [c.padding_m + margin_m, c.gripper_padding_m + margin_m],
        c.attached_padding_m + 0.5 * margin_m,
    )
    kind = world.kind.copy()
    clear_touched(scratch[3][: len(link)], arrays.radii + growth, world_arrays(world), kind, only[0])
    return replace(world, kind=kind)


@lru_cache(maxsize=16)
def robot_arrays(robot: RobotDescription) -> RobotArrays:
    """Return the robot for the compiled checks."""
    arm, model = robot.arm, robot.spheres
    dof = len(arm.joint_names)
    order = np.argsort(model.link, kind="stable")
    link = np.asarray(model.link)[order]
    centers = kernel_array(np.asarray(model.centers)[order])
    radii = kernel_array(np.asarray(model.radii)[order])
    openings = np.linspace(0.0, robot.gripper.max_width_m, 33)
    return RobotArrays(
        base=kernel_array(arm.T_world_base)[:3].copy(),
        parents=kernel_array(arm.Ts_parent_joint)[:, :3].copy(),
        axes=kernel_array(arm.axes),
        tool=kernel_array(arm.T_last_tool0)[:3].copy(),
        tcps=kernel_array(robot.gripper.Ts_tool0_tcp_at(openings)[:, :3]),
        tcp_step_m=float(openings[1]),
        link_start=np.searchsorted(link, np.arange(dof + 4)).astype(np.int64),
        centers=centers,
        radii=radii,
        link_spheres=np.stack([_around(centers[link == i], radii[link == i]) for i in range(dof + 3)]),
        static_spheres=kernel_array(robot.static_spheres).reshape(-1, 4),
        static_links=np.isin(np.arange(dof + 3), robot.static_links),
        self_pairs=kernel_array(robot.self_pairs, np.int64).reshape(-1, 2),
    )


def with_attached(arrays: RobotArrays, attached: Spheres | None) -> RobotArrays:
    """Return the robot with spheres (x, y, z, radius; tool0 frame) attached to its gripper.

    They can touch the robot's fixed parts and all links of the arm but the last, which, like the gripper, never moves
    relative to the held object.
    """
    if attached is None or len(attached) == 0:
        return arrays
    spheres, dof = kernel_array(attached), len(arrays.axes)
    pairs = np.column_stack([np.arange(dof - 1), np.full(dof - 1, dof + 3)])
    return arrays._replace(
        link_start=np.append(arrays.link_start, arrays.link_start[-1] + len(spheres)),
        centers=np.concatenate([arrays.centers, spheres[:, :3]]),
        radii=np.concatenate([arrays.radii, spheres[:, 3]]),
        link_spheres=np.vstack([arrays.link_spheres, _around(spheres[:, :3], spheres[:, 3])]),
        static_links=np.append(arrays.static_links, True),
        self_pairs=kernel_array(np.vstack([arrays.self_pairs, pairs]), np.int64),
    )


def world_arrays(world: CollisionWorld) -> WorldArrays:
    """Return the world for the compiled checks."""
    c = world.config
    padding = np.array(
        [
            [c.padding_m, c.padding_m],
            [c.gripper_padding_m, c.gripper_static_padding_m],
            [c.attached_padding_m, c.attached_static_padding_m],
        ]
    )
    return WorldArrays(
        kernel_array(world.grid.origin),
        float(world.grid.voxel_size_m),
        world.kind,
        world.bits,
        world.distance_m,
        world.block_bits,
        world.block_static,
        kernel_array(world.boxes),
        padding,
        float(c.self_padding_m),
    )


def _around(centers: Float[np.ndarray, "s 3"], radii: Float[np.ndarray, "s"]) -> Float[np.ndarray, "4"]:
    """Return a sphere around spheres; zero if there are none."""
    if len(radii) == 0:
        return np.zeros(4)
    r = radii[:, None]
    middle = 0.5 * ((centers - r).min(axis=0) + (centers + r).max(axis=0))
    return np.append(middle, np.max(np.linalg.norm(centers - middle, axis=1) + radii))


def _arrays(robot: AnyRobot) -> RobotArrays:
    return robot if isinstance(robot, RobotArrays) else robot_arrays(robot)


def _touched(
    world: CollisionWorld,
    arrays: RobotArrays,
    qpos: np.ndarray,
    width_m: np.ndarray | float,
    own_id: np.ndarray | int = -1,
    first_only: bool = True,
    voxels_too: bool = True,
) -> tuple[UInt64[np.ndarray, "n"], np.ndarray]:
    """Return objects touched as bits, and flags, at each configuration; see `contacts_at`."""
    q, n, dof = kernel_array(qpos), len(qpos), len(arrays.axes)
    if q.shape != (n, dof):
        raise InputError(f"qpos must have shape (n, {dof}), not {q.shape}.")
    width = kernel_array(np.broadcast_to(np.asarray(width_m, dtype=float), n))
    own = kernel_array(_bits_of(np.broadcast_to(np.asarray(own_id), n)), np.uint64)
    return contacts_each(q, width, own, arrays, world_arrays(world), first_only, voxels_too)


def contacts_each(
    qpos: Qposes,
    width_m: Float[np.ndarray, "n"],
    own: UInt64[np.ndarray, "n"],
    robot: RobotArrays,
    world: WorldArrays,
    first_only: bool = True,
    voxels_too: bool = True,
) -> tuple[UInt64[np.ndarray, "n"], np.ndarray]:
    """Return objects touched as bits, and flags, at each configuration; see `contact_kernels.contacts_at`."""
    bits, flags = np.zeros(len(qpos), np.uint64), np.zeros(len(qpos), np.uint8)
    columns = (qpos, width_m, own, bits, flags)
    by_rows(contacts_batch, columns, robot, world, first_only, voxels_too, least=128)
    return bits, flags


def _bits_of(ids: np.ndarray) -> UInt64[np.ndarray, "n"]:
    """Return the bit of each id; none for negative ones."""
    return np.where(ids >= 0, np.uint64(1) << np.maximum(ids, 0).astype(np.uint64), np.uint64(0))

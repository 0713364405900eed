"""The collision world: voxels with owners, their distance field, and the fixed boxes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8, UInt64

from torc.collision.distances import distance_field
from torc.collision.obstacles import sum_up_blocks
from torc.errors import InputError
from torc.geometry.transforms import kernel_array
from torc.records import BACKGROUND, OcclusionVolume, VoxelGrid
from torc.workspace.description import Box, Workspace


@dataclass(frozen=True)
class CollisionConfig:
    """How much room to keep. A negative value lets the spheres dip into the obstacle.

    Attributes:
        padding_m: growth of the arm's spheres against voxels and fixed boxes. 10 mm by default: unpadded, half of the
            planned paths touch the true meshes; with 10 mm, 2-4 % do.
        gripper_padding_m: growth of palm and fingers against voxels; small, since grasps are in tight clutter and a
            voxel is already up to 10 mm larger than the surface in it.
        gripper_static_padding_m: likewise against table and bin; fingertips 5 mm above the table must pass.
        attached_padding_m: growth of an attached object's spheres against voxels.
        attached_static_padding_m: likewise against table and bin: in the hand an object shifts by some millimetres, and
            one that touches the table is torn out of it.
        self_padding_m: growth of one of two spheres of the robot itself, whose meshes reach up to 6 mm out of the
            spheres: unpadded, a finger of the UR5e was driven into its upper arm.
        edge_step_m: no point of the robot moves further between two checked configurations of an edge. With edge_step_m
            <= 2 * padding_m the unpadded arm is free on the whole edge.
        explained_margin_m: background surface voxels this close to a fixed box show that box and are not separate
            obstacles.
    """

    padding_m: float = 0.010
    gripper_padding_m: float = 0.002
    gripper_static_padding_m: float = 0.002
    attached_padding_m: float = 0.0
    attached_static_padding_m: float = 0.01
    self_padding_m: float = 0.01
    edge_step_m: float = 0.01
    explained_margin_m: float = 0.015

    def __post_init__(self) -> None:
        if self.edge_step_m <= 0:
            raise InputError("CollisionConfig.edge_step_m must be positive.")


FREE, SURFACE, UNKNOWN = 0, 1, 2
"""Kinds of voxels."""


@dataclass(frozen=True)
class CollisionWorld:
    """Everything but the robot that the robot must not touch. World frame.

    Attributes:
        grid: where the voxels are. Outside it only the fixed boxes are obstacles.
        kind: FREE, SURFACE or UNKNOWN per voxel.
        bits: per voxel the objects it belongs to, bit k for object id k: the surface's owner, or those that hide an
            unknown voxel. 0 on an occupied voxel: it belongs to no object and counts as fixed.
        distance_m: from each voxel's centre to the nearest occupied voxel's centre. Never more than the truth, but less
            after `without_object` or `carved`, which only remove voxels.
        boxes: fixed boxes, lower and upper corner.
        box_names: their names.
        config: paddings.
        block_bits, block_static: owners combined over blocks of voxels, see `WorldArrays`; never less than the truth.
    """

    grid: VoxelGrid
    kind: UInt8[np.ndarray, "nx ny nz"]
    bits: UInt64[np.ndarray, "nx ny nz"]
    distance_m: Float32[np.ndarray, "nx ny nz"]
    boxes: Float[np.ndarray, "b 6"]
    box_names: tuple[str, ...]
    config: CollisionConfig
    block_bits: UInt64[np.ndarray, "bx by bz 2"]
    block_static: Bool[np.ndarray, "bx by bz"]

    def without_object(self, object_id: int, unknown: bool = True) -> "CollisionWorld":
        """Return this world without an object's surface voxels and, with `unknown`, without those that it hides."""
        own = (self.bits & np.uint64(1 << object_id)) != 0
        gone = own if unknown else own & (self.kind == SURFACE)
        return replace(self, kind=np.where(gone, np.uint8(FREE), self.kind))


def build_collision_world(
    volume: OcclusionVolume, fixed: Workspace | Sequence[Box], config: CollisionConfig | None = None
) -> CollisionWorld:
    """Build the world to check against: surface and never-seen voxels of the volume, and fixed boxes.

    Background surface next to a fixed box shows that box and is left to it; other background surface is an obstacle
    without an owner. Unseen voxels hidden by nothing that has an id have no owner either.
    """
    config = CollisionConfig() if config is None else config
    static = fixed.static_boxes() if isinstance(fixed, Workspace) else tuple(fixed)
    middle = np.array([box.center for box in static], dtype=float).reshape(-1, 3)
    half = np.array([box.size for box in static], dtype=float).reshape(-1, 3) / 2
    boxes = np.hstack([middle - half, middle + half])
    kind, bits = _classify(volume, boxes, config)
    return world_from_voxels(volume.grid, kind, bits, boxes, tuple(b.name for b in static), config)


def world_from_voxels(
    grid: VoxelGrid,
    kind: UInt8[np.ndarray, "nx ny nz"],
    bits: UInt64[np.ndarray, "nx ny nz"],
    boxes: Float[np.ndarray, "b 6"],
    box_names: tuple[str, ...],
    config: CollisionConfig,
) -> CollisionWorld:
    """Build the world of classified voxels and fixed boxes; see CollisionWorld."""
    kind, bits = kernel_array(kind, np.uint8), kernel_array(bits, np.uint64)
    distance = distance_field(kind != FREE, grid.voxel_size_m)
    block_kind, block_bits = sum_up_blocks(kind, bits)
    return CollisionWorld(grid, kind, bits, distance, boxes, box_names, config, block_kind, block_bits)


def _classify(
    volume: OcclusionVolume, boxes: Float[np.ndarray, "b 6"], config: CollisionConfig
) -> tuple[UInt8[np.ndarray, "nx ny nz"], UInt64[np.ndarray, "nx ny nz"]]:
    """Return kind and owners of every voxel. A surface voxel counts whatever `seen` says."""
    label = volume.surface_label
    owned = label >= 0
    kind = np.where(volume.seen, np.uint8(FREE), np.uint8(UNKNOWN))
    bits = np.where(volume.seen, np.uint64(0), volume.hidden_by)
    kind[owned] = SURFACE
    bits[owned] = np.uint64(1) << label[owned].astype(np.uint64)
    background = np.argwhere(label == BACKGROUND)
    if len(background):
        center = volume.grid.origin + volume.grid.voxel_size_m * (background + 0.5)
        near = np.zeros(len(background), dtype=bool)
        for box in boxes:
            gap = np.maximum(np.maximum(box[:3] - center, center - box[3:]), 0.0)
            near |= np.einsum("ij,ij->i", gap, gap) <= config.explained_margin_m**2
        x, y, z = background.T
        kind[x, y, z] = np.where(near, np.uint8(FREE), np.uint8(SURFACE))
        bits[x, y, z] = 0
    return kind, bits

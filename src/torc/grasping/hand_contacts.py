"""Find what the gripper alone touches, voxel by voxel."""

import numpy as np
from jaxtyping import Bool, Float, UInt64
from numba import njit

from torc.collision.collision_world import FREE, SURFACE, CollisionWorld
from torc.geometry.transforms import kernel_array
from torc.grasping.hand import HandGeometry, reach_at
from torc.parallel import by_rows
from torc.records import GraspSet, OcclusionVolume, VoxelGrid

_LATTICE_M = 0.01


def hand_contacts(
    grasps: GraspSet, world: CollisionWorld, hand: HandGeometry
) -> tuple[UInt64[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Return the objects (bit masks) and fixed things that the open gripper touches at each grasp.

    Counts as `torc.collision.contacts.blockers` does: voxels hidden by the own object and its surface are left out;
    occupied voxels without an owner are fixed.
    """
    paddings_m = np.array([world.config.gripper_padding_m, world.config.gripper_static_padding_m])
    return _touched(grasps, hand, world.kind, world.bits, world.grid, world.boxes, paddings_m)


def voxel_blockers(grasps: GraspSet, volume: OcclusionVolume, hand: HandGeometry) -> UInt64[np.ndarray, "n"]:
    """Return other objects whose surface voxels, or never-seen voxels hidden by them, the open gripper touches."""
    owned = volume.surface_label >= 0
    kind = np.where(volume.seen & ~owned, np.uint8(FREE), np.uint8(SURFACE))
    bit = np.uint64(1) << np.maximum(volume.surface_label, 0).astype(np.uint64)
    owners = np.where(owned, bit, volume.hidden_by)
    return _touched(grasps, hand, kind, owners, volume.grid, np.zeros((0, 6)), np.zeros(2))[0]


def _touched(
    grasps: GraspSet,
    hand: HandGeometry,
    kind: np.ndarray,
    owners: np.ndarray,
    grid: VoxelGrid,
    fixed: Float[np.ndarray, "b 6"],
    paddings_m: Float[np.ndarray, "2"],
) -> tuple[UInt64[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Return objects and fixed things touched; paddings against voxels and fixed boxes."""
    bits, static = np.zeros(len(grasps), np.uint64), np.zeros(len(grasps), np.bool_)
    rows = (
        kernel_array(grasps.Ts_world_tcp),
        kernel_array(grasps.widths_m),
        kernel_array(grasps.object_ids, np.int64),
        bits,
        static,
    )
    kind, owners = kernel_array(kind, np.uint8), kernel_array(owners, np.uint64)
    by_rows(
        _contacts,
        rows,
        open_boxes(hand),
        hand.reach_m,
        (kind, owners, _tops(kind), kernel_array(grid.origin), float(grid.voxel_size_m)),
        kernel_array(fixed).reshape(-1, 6),
        paddings_m,
    )
    return bits, static


def open_boxes(hand: HandGeometry) -> Float[np.ndarray, "b 6"]:
    """Return centre and half size of all boxes of the open gripper, in the frame of its TCP: fingers, then the rest."""
    opening, _, _, half_y, thickness, length = hand[:6]
    x = opening / 2 + thickness / 2
    fingers = [[s * x, 0.0, -length / 2, thickness / 2, half_y, length / 2] for s in (-1, 1)]
    return np.concatenate([np.array(fingers), hand.palm])


@njit(cache=True)
def _tops(kind):
    """Return the highest voxel of each column that is not free, -1 where all are: most of a gripper is above them."""
    out = np.full(kind.shape[:2], -1)
    for i in range(kind.shape[0]):
        for j in range(kind.shape[1]):
            for k in range(kind.shape[2] - 1, -1, -1):
                if kind[i, j, k] != FREE:
                    out[i, j] = k
                    break
    return out


@njit(cache=True, nogil=True)
def _contacts(Ts, widths, own_ids, bits, static, parts, reach_m, voxels, fixed, paddings):
    center = np.empty(3)
    for n in range(len(widths)):
        R = Ts[n, :3, :3]
        own = np.uint64(1) << np.uint64(own_ids[n])
        shift_z = -reach_at(reach_m, widths[n])
        for b in range(len(parts)):
            for k in range(3):
                center[k] = (
                    Ts[n, k, 3]
                    + R[k, 0] * parts[b, 0]
                    + R[k, 1] * parts[b, 1]
                    + R[k, 2] * (parts[b, 2] + shift_z)
                )
            half = parts[b, 3:]
            bits[n], static[n] = _voxels_in_box(R, center, half, paddings[0], own, voxels, bits[n], static[n])
            static[n] = static[n] or _in_fixed(R, center, half, fixed, paddings[1])


@njit(cache=True)
def _extent(R, axis, half):
    """Return the half width of a turned box along an axis of the world."""
    return abs(R[axis, 0]) * half[0] + abs(R[axis, 1]) * half[1] + abs(R[axis, 2]) * half[2]


@njit(cache=True)
def _voxels_in_box(R, center, half, padding_m, own, voxels, bits, ownerless):
    """Return the owners of occupied voxels in a box, padded by half a voxel more, and whether some have no owner.

    Beside those known before: only voxels that would add something are compared with the box.
    """
    kind, owners, tops, origin, voxel_m = voxels
    lower, upper, grown = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3)
    for k in range(3):
        grown[k] = half[k] + padding_m + 0.5 * voxel_m
    for k in range(3):
        extent = _extent(R, k, grown)
        lower[k] = max(0, int(np.floor((center[k] - extent - origin[k]) / voxel_m)))
        upper[k] = min(kind.shape[k] - 1, int(np.floor((center[k] + extent - origin[k]) / voxel_m)))
    for i in range(lower[0], upper[0] + 1):
        x = origin[0] + (i + 0.5) * voxel_m - center[0]
        for j in range(lower[1], upper[1] + 1):
            y = origin[1] + (j + 0.5) * voxel_m - center[1]
            for k in range(lower[2], min(upper[2], tops[i, j]) + 1):
                of = owners[i, j, k]
                if kind[i, j, k] == FREE or of & own != 0 or (of & ~bits == 0 and (of != 0 or ownerless)):
                    continue
                z = origin[2] + (k + 0.5) * voxel_m - center[2]
                inside = True
                for a in range(3):
                    if abs(R[0, a] * x + R[1, a] * y + R[2, a] * z) > grown[a]:
                        inside = False
                        break
                if inside:
                    bits |= of
                    ownerless |= of == 0
    return bits, ownerless


@njit(cache=True)
def _in_fixed(R, center, half, fixed, padding_m):
    """Check whether some point of a box's 1 cm lattice (corners included) lies in a fixed box, grown."""
    for f in range(len(fixed)):
        apart = False
        for a in range(3):
            extent = _extent(R, a, half)
            apart |= center[a] - extent > fixed[f, 3 + a] + padding_m
            apart |= center[a] + extent < fixed[f, a] - padding_m
        if not apart and _lattice_in(R, center, half, fixed[f], padding_m):
            return True
    return False


@njit(cache=True)
def _lattice_in(R, center, half, fixed, padding_m):
    """Do the same for one fixed box, point by point."""
    steps = np.empty(3, np.int64)
    for a in range(3):
        steps[a] = max(1, int(np.ceil(2 * half[a] / _LATTICE_M)))
    for i in range(steps[0] + 1):
        x = half[0] * (2.0 * i / steps[0] - 1.0)
        for j in range(steps[1] + 1):
            y = half[1] * (2.0 * j / steps[1] - 1.0)
            for k in range(steps[2] + 1):
                z = half[2] * (2.0 * k / steps[2] - 1.0)
                inside = True
                for a in range(3):
                    c = center[a] + R[a, 0] * x + R[a, 1] * y + R[a, 2] * z
                    if c < fixed[a] - padding_m or c > fixed[3 + a] + padding_m:
                        inside = False
                        break
                if inside:
                    return True
    return False

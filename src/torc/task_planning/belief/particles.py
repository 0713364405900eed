"""Draw poses of a hidden target that fit the space that was never seen.

The poses are drawn anew at every look from the occlusion volume, which remembers all that was seen so far. No other
update is needed: the target does not move, so its possible places after several looks are those before the first one,
less those that any look has shown to be free or full, and the volume holds just these. A filter that carries particles
along would have the same ones, and fewer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64, UInt64

from torc.geometry.transforms import kernel_array
from torc.grasping.cells import thin_out
from torc.grasping.completion import assumed_body
from torc.grasping.config import CloudConfig
from torc.records import OcclusionVolume, SegmentedScene, VoxelGrid
from torc.task_planning.belief.box_kernels import Boxes, extended_down, fit_shares, settle
from torc.task_planning.belief.settings import ParticleConfig

_FEWEST_POINTS = 5
_FALL_SLACK_M = 0.01
_UNSEEN = 0.6
"""A small cube fits if more than this share of it was never seen, and as much lies outside all bodies in sight."""
_FLAT = 0.3
"""Assumed height of a disc or ball, as a share of its width: too small rather than too large."""
_ACROSS = (1.0, 0.5, 0.25)
"""Width to breadth of the boxes that stand for a target of known length and thickness."""
_UPRIGHT = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])
"""The edges that lie along the heading, across it and upwards."""


@dataclass(frozen=True)
class Bodies:
    """Boxes around the objects in sight that show enough of themselves, as arguments of `box_kernels`.

    Attributes:
        boxes: one row per object, world frame.
        bits: bit k for object id k.
    """

    boxes: Boxes
    bits: UInt64[np.ndarray, "m"]


def grid_frame(grid: VoxelGrid) -> Float[np.ndarray, "4"]:
    """Return a grid's frame as the kernels expect it: origin and voxel edge, metres."""
    return np.array([*grid.origin, grid.voxel_size_m], dtype=float)


def bodies_of(scene: SegmentedScene, volume: OcclusionVolume) -> Bodies:
    """Return the boxes that the objects in sight are assumed to fill, by the grasp planner's `assumed_body`.

    A box whose lower end is out of sight extends down through unseen space to the support or the next body, since most
    things stand on something.
    """
    config, support_z_m = CloudConfig(), float(volume.grid.origin[2])
    camera = np.asarray(scene.observation.T_world_camera, dtype=float)[:3, 3]
    bits: list[int] = []
    rows: list[Float[np.ndarray, 8]] = []
    for o in scene.objects:
        if len(o.points) < _FEWEST_POINTS:
            continue
        points, _ = thin_out(o.points, o.normals, config.voxel_m)
        body = assumed_body(points, np.asarray(o.felt, dtype=float), camera, support_z_m, config)
        bits.append(1 << o.id)
        rows.append(np.array([*body.center, *body.size_m / 2, *body.view[:2]]))
    boxes = np.array(rows, dtype=float).reshape(len(rows), 8)
    if len(boxes):
        boxes = extended_down(
            kernel_array(boxes), kernel_array(volume.seen, np.bool_), grid_frame(volume.grid)
        )
    return Bodies(boxes, np.array(bits, dtype=np.uint64))


@dataclass(frozen=True)
class Particles:
    """Poses of a hidden target, each a box with a weight.

    Attributes:
        poses: boxes as `box_kernels` expects them, world frame.
        weights: sum to 1, unless there is no particle.
        rests_on: bit of the object in sight that each lies on, 0 for none.
        room: share of the space over the support in which a target of the given size may be: the share of its columns
            of voxels that are hidden somewhere, times how well proposals fit there on average. None if no size was
            given.
    """

    poses: Boxes
    weights: Float[np.ndarray, "n"]
    rests_on: UInt64[np.ndarray, "n"]
    room: float | None

    def __len__(self) -> int:
        return len(self.weights)


def hidden_voxels(volume: OcclusionVolume) -> Int64[np.ndarray, "n 3"]:
    """Return the index of each voxel that was never seen and that an object hides."""
    return np.argwhere(volume.hidden_by != 0)


def propose(
    volume: OcclusionVolume,
    bodies: Bodies,
    config: ParticleConfig,
    rng: np.random.Generator,
    size_m: tuple[float, float] | None = None,
) -> Particles:
    """Propose poses of a hidden target, none if nothing is hidden.

    Args:
        volume: what was seen.
        bodies: boxes of the objects in sight.
        config: number and fit of the proposals.
        rng: draws them.
        size_m: the target's length and thickness; None if unknown.
    """
    voxels = hidden_voxels(volume)
    if not config.told_size:
        size_m = None
    if len(voxels) == 0:
        room = None if size_m is None else 0.0
        return Particles(np.zeros((0, 8)), np.zeros(0), np.zeros(0, np.uint64), room)
    standing = round(config.on_support * config.proposals)
    sizes = config.sizes_m if size_m is None else boxes_like(*size_m)
    poses = _draw(voxels, volume.grid, standing, config.proposals, sizes, rng)
    on = np.zeros(len(poses), np.uint64)
    lying = poses[standing:]
    on[standing:] = settle(lying, bodies.boxes, bodies.bits, _FALL_SLACK_M)
    poses[standing:] = lying
    seen = kernel_array(volume.seen, np.bool_)
    shares = fit_shares(poses, bodies.boxes, config.body_scale, seen, grid_frame(volume.grid))
    weights = fit_weights(shares, config)
    nx, ny, _ = volume.grid.shape
    hidden = len(np.unique(voxels[:, :2], axis=0)) / (nx * ny)
    # Every stratum keeps its share: of each, the first ones that fit.
    kept = np.flatnonzero(weights > 0)
    if len(kept) > config.most:
        kept = kept[np.linspace(0, len(kept) - 1, config.most).astype(int)]
    total = weights[kept].sum()
    room = None if size_m is None else hidden * float(weights.mean())
    return Particles(poses[kept], weights[kept] / total if len(kept) else weights[kept], on[kept], room)


def boxes_like(length_m: float, thickness_m: float) -> tuple[tuple[float, float, float], ...]:
    """Return the edges of boxes of that corner-to-corner length that pass through a tube of that width.

    One is square across, the others are flatter.
    """
    along = max(np.sqrt(max(length_m**2 - thickness_m**2, 0.0)), _FLAT * thickness_m)
    across = [(ratio, thickness_m / np.sqrt(1 + ratio**2)) for ratio in _ACROSS]
    return tuple((float(ratio * wide), float(wide), float(along)) for ratio, wide in across)


def unseen_room(
    volume: OcclusionVolume, bodies: Bodies, size_m: float, proposals: int, rng: np.random.Generator
) -> float:
    """Return the share of the columns of space over the support in which a small cube would have stayed unseen.

    Cubes are drawn in hidden space; one counts if most of it is unseen and its middle is not inside a body in sight.
    """
    voxels = hidden_voxels(volume)
    if len(voxels) == 0:
        return 0.0
    nx, ny, _ = volume.grid.shape
    cubes = np.zeros((proposals, 8))
    chosen = voxels[rng.integers(len(voxels), size=proposals)]
    cubes[:, :3] = volume.grid.origin + volume.grid.voxel_size_m * (chosen + rng.random(chosen.shape))
    cubes[:, 3:6], cubes[:, 6] = size_m / 2, 1.0
    seen = kernel_array(volume.seen, np.bool_)
    shares = fit_shares(cubes, bodies.boxes, 1.0, seen, grid_frame(volume.grid))
    fits = (shares[:, 0] > _UNSEEN) & (shares[:, 1] < 1 - _UNSEEN)
    return len(np.unique(chosen[fits, :2], axis=0)) / (nx * ny)


def fit_weights(shares: Float[np.ndarray, "n 2"], config: ParticleConfig) -> Float[np.ndarray, "n"]:
    """Return how well poses fit, 0 to 1, given their `fit_shares`."""
    unseen = (shares[:, 0] - config.least_unseen_share) / (config.unseen_share - config.least_unseen_share)
    fit = np.clip(unseen, 0.0, 1.0)
    if config.most_inside_share < 1:
        room = config.most_inside_share - config.inside_share
        fit = fit * np.clip((config.most_inside_share - shares[:, 1]) / room, 0.0, 1.0)
    return np.where(fit < 1e-9, 0.0, fit)


def _draw(
    voxels: Int64[np.ndarray, "v 3"],
    grid: VoxelGrid,
    standing: int,
    count: int,
    candidates: Sequence[tuple[float, float, float]],
    rng: np.random.Generator,
) -> Boxes:
    """Draw poses of boxes with any of these edges, those on the support first.

    A pose on the support stands in any such column with equal probability; the others have their lower side in any
    hidden voxel.
    """
    columns = np.unique(voxels[:, :2], axis=0)
    lying = count - standing
    at = np.concatenate(
        [
            np.insert(columns[rng.integers(len(columns), size=standing)], 2, 0, axis=1),
            voxels[rng.integers(len(voxels), size=lying)],
        ]
    )
    places = grid.origin + grid.voxel_size_m * (at + rng.random(at.shape))
    places[:standing, 2] = grid.origin[2]
    sizes = np.array(candidates, dtype=float)[rng.integers(len(candidates), size=len(at))]
    edges = np.take_along_axis(sizes, _UPRIGHT[rng.integers(3, size=len(at))], axis=1)
    yaw = rng.uniform(0.0, np.pi, len(at))
    places[:, 2] += edges[:, 2] / 2
    poses = np.concatenate([places, edges / 2, np.cos(yaw)[:, None], np.sin(yaw)[:, None]], axis=1)
    return kernel_array(poses)

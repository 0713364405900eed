"""Find the objects that hide each place where the target may be, layer behind layer."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt64

from torc.geometry.transforms import kernel_array
from torc.records import OcclusionVolume
from torc.task_planning.belief.box_kernels import Boxes, hider_masks
from torc.task_planning.belief.particles import Bodies, Particles, grid_frame, hidden_voxels
from torc.task_planning.belief.settings import HidingConfig

_ONE = np.uint64(1)
_NEAR_M = 0.005
"""A body is above a pose if it overlaps it by this much along both axes, and its lower side is no lower than this."""


@dataclass(frozen=True)
class Belief:
    """Places where the target may be, as boxes and as single points of hidden space, with what hides each.

    Attributes:
        poses: boxes as `box_kernels` expects them; single points have no extent.
        weights: sum to 1, unless there is no place.
        masks: per place and point the bits of all objects that hide it; 0 if nothing with an id does.
        hidden: which points were never seen; the others do not count.
        front: per place and object id the share of its hidden points that the object hides in the picture.
        above: bits of the objects in sight that lie above a place.
        rests_on: bit of the object that a place rests on, 0 for none.
        fitting: how many of the places are particles; the others are single points.
    """

    poses: Boxes
    weights: Float[np.ndarray, "n"]
    masks: UInt64[np.ndarray, "n 27"]
    hidden: Bool[np.ndarray, "n 27"]
    front: Float[np.ndarray, "n 64"]
    above: UInt64[np.ndarray, "n"]
    rests_on: UInt64[np.ndarray, "n"]
    fitting: int

    def __len__(self) -> int:
        return len(self.weights)

    def mass_hidden(self) -> Float[np.ndarray, "64"]:
        """Return, per object id, the share of the belief that the object hides in the picture."""
        return self.weights @ self.front

    def mass_behind(self) -> Float[np.ndarray, "64"]:
        """Return, per object id, the share of the belief behind the object, in any layer."""
        out = np.zeros(64)
        count = np.maximum(self.hidden.sum(axis=1), 1)
        for k in range(64):
            out[k] = self.weights @ (((self.masks >> np.uint64(k)) & _ONE).sum(axis=1) / count)
        return out


def believe(
    particles: Particles,
    volume: OcclusionVolume,
    bodies: Bodies,
    eye: Float[np.ndarray, "3"],
    config: HidingConfig,
    rng: np.random.Generator,
) -> Belief:
    """Build the belief from particles and the plain hidden volume; `eye` is the camera's position, world frame."""
    points = _plain_points(volume, config, rng)
    share = config.plain_share if len(particles) else 1.0
    poses = np.concatenate([particles.poses, points])
    weights = np.concatenate(
        [(1 - share) * particles.weights, np.full(len(points), share / max(len(points), 1))]
    )
    if len(points) == 0 and len(particles):
        weights = particles.weights
    kept = weights > 0
    fitting = int(np.count_nonzero(kept[: len(particles)]))
    poses, weights = kernel_array(poses[kept]), weights[kept]
    hidden_by, seen = kernel_array(volume.hidden_by, np.uint64), kernel_array(volume.seen, np.bool_)
    eye_scale = np.array([*eye, config.layer_scale if config.all_layers else 0.0])
    frame = grid_frame(volume.grid)
    masks, hidden = hider_masks(poses, bodies.boxes, bodies.bits, eye_scale, seen, hidden_by, frame)
    rests = np.concatenate([particles.rests_on, np.zeros(len(points), np.uint64)])[kept]
    front = _front_shares(poses, hidden, volume)
    above = _above(poses, bodies)
    return Belief(poses, weights, masks, hidden, front, above, rests, fitting)


def _plain_points(volume: OcclusionVolume, config: HidingConfig, rng: np.random.Generator) -> Boxes:
    """Draw centres of hidden voxels as boxes without extent."""
    voxels = hidden_voxels(volume)
    if len(voxels) == 0 or config.plain_share == 0:
        return np.zeros((0, 8))
    chosen = voxels[rng.integers(len(voxels), size=config.plain_points)]
    out = np.zeros((len(chosen), 8))
    out[:, :3] = volume.grid.origin + volume.grid.voxel_size_m * (chosen + 0.5)
    out[:, 6] = 1.0
    return out


def _front_shares(
    poses: Boxes, hidden: Bool[np.ndarray, "n 27"], volume: OcclusionVolume
) -> Float[np.ndarray, "n 64"]:
    """Return, per pose and object, the share of the hidden points that the object hides in the picture."""
    none = np.zeros((0, 8))
    bits, eye_scale = np.zeros(0, np.uint64), np.zeros(4)
    seen, hidden_by = kernel_array(volume.seen, np.bool_), kernel_array(volume.hidden_by, np.uint64)
    masks, _ = hider_masks(poses, none, bits, eye_scale, seen, hidden_by, grid_frame(volume.grid))
    out = np.zeros((len(poses), 64))
    rows, points = np.nonzero(masks)
    np.add.at(out, (rows, np.log2(masks[rows, points].astype(float)).astype(int)), 1.0)
    return out / np.maximum(hidden.sum(axis=1), 1)[:, None]


def _above(poses: Boxes, bodies: Bodies) -> UInt64[np.ndarray, "n"]:
    """Return the bodies that overlap each pose seen from above, and lie higher, by circles in their outlines."""
    out = np.zeros(len(poses), np.uint64)
    radius = poses[:, 3:5].min(axis=1)
    for box, bit in zip(bodies.boxes, bodies.bits):
        away = np.linalg.norm(poses[:, :2] - box[:2], axis=1)
        over = away < radius + box[3:5].min() - _NEAR_M
        higher = box[2] - box[5] >= poses[:, 2] + poses[:, 5] - 2 * _NEAR_M
        out[over & higher & (radius > 0)] |= bit
    return out

"""Build thinned-out clouds of one snapshot, in the form that the kernels expect."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numba import njit

from torc.geometry.extent import spiral
from torc.grasping.cells import PointCells, group, thin_out
from torc.grasping.completion import Completion, complete
from torc.grasping.config import CloudConfig
from torc.parallel import each
from torc.records import OcclusionVolume, SegmentedObject, SegmentedScene

_HULL_DIRECTIONS = 64
_FLAT_M, _FEWEST = 0.015, 20
"""Points this close to the support's height are the support, if there are at least this many."""
_NEAR_M, _SAMPLES = 0.006, 60


@dataclass(frozen=True)
class ObjectCloud:
    """One object: its seen points, and a guess at its back.

    Attributes:
        id: object id.
        points: seen points (the first `visible` rows), `felt` ones, then those guessed on its hidden back; world frame.
        normals: outward unit normals of these points; zero where unknown.
        visible, felt: how many of the points were seen, and felt.
        cells: these points grouped; the tag is 1 for seen and felt ones, 0 for guessed ones.
        hull: points that are outermost in some direction, for extents.
        completion: estimated centre and size.
        pixel_count: pixels of its mask.
        roughness_m: mean distance of its points from the planes through those near by.
        support_roughness_m: standard deviation of the height at which the support is seen.
        sureness: probability that its mask is one object; 1 if masks are given.
    """

    id: int
    points: Float[np.ndarray, "n 3"]
    normals: Float[np.ndarray, "n 3"]
    visible: int
    felt: int
    cells: PointCells
    hull: Float[np.ndarray, "h 3"]
    completion: Completion
    pixel_count: int
    roughness_m: float = 0.0
    support_roughness_m: float = 0.0
    sureness: float = 1.0

    @property
    def seen(self) -> Float[np.ndarray, "v 3"]:
        """The seen points."""
        return self.points[: self.visible]


@dataclass(frozen=True)
class SceneClouds:
    """The input of the generators, checks and features.

    Attributes:
        objects: objects large enough to be grasped, by rising id.
        cells: the seen points of all objects, including small ones, tagged with their ids; coarser than `objects`.
        forward: horizontal direction in which the camera looks.
        camera_position: world frame.
    """

    objects: tuple[ObjectCloud, ...]
    cells: PointCells
    forward: Float[np.ndarray, "3"]
    camera_position: Float[np.ndarray, "3"]


def build_clouds(
    scene: SegmentedScene, volume: OcclusionVolume, support_z_m: float, config: CloudConfig
) -> SceneClouds:
    """Thin out and complete the clouds of a scene."""
    camera = np.asarray(scene.observation.T_world_camera, dtype=float)
    sureness = {k.id: k.sureness for k in scene.known}
    support_roughness_m = _support_roughness_m(scene, support_z_m)
    seen = [o for o in scene.objects if len(o.points)]

    def build(o: SegmentedObject) -> tuple[np.ndarray, ObjectCloud | None]:
        points, normals = thin_out(o.points, o.normals, config.voxel_m)
        thin = thin_out(points, normals, config.neighbour_voxel_m)[0]
        if o.pixel_count < config.min_pixels:
            return thin, None
        felt = np.asarray(o.felt, dtype=points.dtype)
        done = complete(points, normals, felt, camera[:3, 3], o.id, volume, support_z_m, config)
        surface, outward = (np.array(a, dtype=np.float64, order="C") for a in (o.points, o.normals))
        both = np.concatenate([points, felt, done.points])
        known = (np.arange(len(both)) < len(points) + len(felt)).astype(np.int64)
        return thin, ObjectCloud(
            id=o.id,
            points=both,
            normals=np.concatenate([normals, np.zeros_like(felt), done.normals]),
            visible=len(points),
            felt=len(felt),
            cells=group(both, known, config.cell_m),
            hull=both[np.unique(np.argmax(both @ spiral(_HULL_DIRECTIONS).T, axis=0))],
            completion=done,
            pixel_count=o.pixel_count,
            roughness_m=_roughness(surface, outward, _NEAR_M, _SAMPLES),
            support_roughness_m=support_roughness_m,
            sureness=sureness.get(o.id, 1.0),
        )

    built = each(build, seen)
    cells = _group_all([(o.id, thin) for o, (thin, _) in zip(seen, built)], config)
    objects = tuple(cloud for _, cloud in built if cloud is not None)
    return SceneClouds(objects, cells, forward_direction(camera), camera[:3, 3])


def _support_roughness_m(scene: SegmentedScene, support_z_m: float) -> float:
    """Return the standard deviation, by the median, of the height of points near the support."""
    height = scene.background_points[:, 2] - support_z_m
    flat = height[np.abs(height) < _FLAT_M]
    return 1.48 * float(np.median(np.abs(flat - np.median(flat)))) if len(flat) >= _FEWEST else 0.0


@njit(cache=True, nogil=True)
def _roughness(points, normals, near, samples):
    """Return the mean distance of about `samples` points from the planes of points near by."""
    total, count = 0.0, 0
    step = max(1, points.shape[0] // samples)
    for i in range(0, points.shape[0], step):
        for j in range(points.shape[0]):
            dx = points[j, 0] - points[i, 0]
            dy = points[j, 1] - points[i, 1]
            dz = points[j, 2] - points[i, 2]
            if i != j and dx * dx + dy * dy + dz * dz < near * near:
                total += abs(dx * normals[i, 0] + dy * normals[i, 1] + dz * normals[i, 2])
                count += 1
    return total / count if count else 0.0


def scene_cells(scene: SegmentedScene, config: CloudConfig) -> PointCells:
    """Return the thinned-out points of all objects of a scene, grouped and tagged with their ids."""
    size_m, seen = config.neighbour_voxel_m, [o for o in scene.objects if len(o.points)]
    return _group_all(each(lambda o: (o.id, thin_out(o.points, o.normals, size_m)[0]), seen), config)


def forward_direction(T_world_camera: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, "3"]:
    """Return the horizontal direction in which the camera looks; if it looks straight down, its image's up."""
    for axis in (T_world_camera[:3, 2], -T_world_camera[:3, 1]):
        flat = np.array([axis[0], axis[1], 0.0])
        if np.linalg.norm(flat) > 0.1:
            return flat / np.linalg.norm(flat)
    return np.array([1.0, 0.0, 0.0])


def _group_all(thin: list[tuple[int, np.ndarray]], config: CloudConfig) -> PointCells:
    points = np.concatenate([p for _, p in thin] or [np.zeros((0, 3))])
    ids = np.repeat(np.array([i for i, _ in thin], dtype=np.int64), [len(p) for _, p in thin])
    return group(points, ids, config.cell_m)

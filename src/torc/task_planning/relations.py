"""Find which object is behind or below which, from masks and depth alone (paper: Approach 2, steps 1-3).

Masks that touch once dilated are neighbours. Of two neighbours the one whose boundary is farther away, on average, is
'behind' the other. The pair is 'below' instead if enough boundary points of one object face upwards, are close to the
other object, and lie lower than its closest point.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Int32, Int64

from torc.errors import InputError
from torc.geometry.transforms import kernel_array
from torc.records import SegmentedScene
from torc.records.derived import once
from torc.records.graph import DependencyEdge, EdgeKind
from torc.task_planning.relation_kernels import measure_boundaries, nearby_labels

_AUTHORS_ROWS = 1080
"""Image height at which the authors' pixel numbers hold; their camera has our field of view."""


@dataclass(frozen=True)
class RelationConfig:
    """Numbers of the relation test; the authors' own where they are known.

    Attributes:
        dilation_px: radius of the disk that dilates masks, at 1080 image rows; scaled to the image's height.
        min_dilation_px: least radius after scaling.
        min_support: 'below' needs more supporting boundary points than this, at 1080 image rows; scaled by the square
            of the image's height, as the number of pixels on a patch of surface.
        closeness_m: distance within which a point of the other object counts as close.
        closeness_samples: a point within this many pixel widths on the surface is also close: in coarse images,
            touching objects have no two points within 6 mm where the surface is seen at a slant.
        upright_cos: least z of a unit normal that faces upwards; cos 45 deg.
    """

    dilation_px: float = 4.0
    min_dilation_px: float = 2.0
    min_support: float = 50.0
    closeness_m: float = 0.006
    closeness_samples: float = 4.0
    upright_cos: float = 0.7071

    def __post_init__(self) -> None:
        if min(self.dilation_px, self.min_dilation_px, self.closeness_m) <= 0:
            raise InputError("dilation_px, min_dilation_px and closeness_m must be positive.")


@dataclass(frozen=True)
class Adjacency:
    """How the masks of two neighbours meet; `first` has the lower id.

    Attributes:
        pixels: boundary pixels with a depth, of first and second.
        mean_depth_m: their mean depth.
        below_support: boundary points of first that support 'first is below second', and vice versa.
    """

    first: int
    second: int
    pixels: tuple[int, int]
    mean_depth_m: tuple[float, float]
    below_support: tuple[int, int]


def dilation_radius_px(rows: int, config: RelationConfig) -> float:
    """Return the radius of the dilating disk for an image of that height."""
    return max(config.min_dilation_px, config.dilation_px * rows / _AUTHORS_ROWS)


def needed_support(rows: int, config: RelationConfig) -> float:
    """Return the number of boundary points that 'below' must exceed in an image of that height."""
    return config.min_support * (rows / _AUTHORS_ROWS) ** 2


def find_adjacencies(scene: SegmentedScene, config: RelationConfig | None = None) -> tuple[Adjacency, ...]:
    """Return all pairs of visible objects whose masks meet, with depth on both sides, by rising ids."""
    config = RelationConfig() if config is None else config
    return once(scene, ("adjacencies", config), lambda: _adjacencies(scene, config))


def _adjacencies(scene: SegmentedScene, config: RelationConfig) -> tuple[Adjacency, ...]:
    ids = scene.ids
    if len(ids) < 2:
        return ()
    label = kernel_array(scene.label_image, np.int16)
    depth = kernel_array(scene.observation.depth_m, np.float32)
    known = np.uint64(sum(1 << k for k in ids))
    near = nearby_labels(label, known, _disk(dilation_radius_px(label.shape[0], config)))
    index, points, normals = _point_image(scene)
    count, depth_sum, support = measure_boundaries(
        label,
        depth,
        near,
        index,
        points,
        normals,
        known,
        float(scene.observation.K[0, 0]),
        config.closeness_m,
        config.closeness_samples,
        config.upright_cos,
    )
    found = []
    for a, b in np.argwhere(np.triu((count > 0) & (count.T > 0), 1)).tolist():
        means = (float(depth_sum[a, b] / count[a, b]), float(depth_sum[b, a] / count[b, a]))
        pixels, supports = (int(count[a, b]), int(count[b, a])), (int(support[a, b]), int(support[b, a]))
        found.append(Adjacency(a, b, pixels, means, supports))
    return tuple(found)


def behind_candidates(adjacencies: tuple[Adjacency, ...]) -> tuple[DependencyEdge, ...]:
    """Return the 'behind' pairs by depth alone, before any is corrected to 'below'. Pairs at equal depth have none."""
    found = []
    for pair in adjacencies:
        a, b = pair.mean_depth_m
        if a != b:
            found.append(_relation(pair, EdgeKind.BEHIND, first_is_source=a > b))
    return tuple(found)


def find_relations(scene: SegmentedScene, config: RelationConfig | None = None) -> tuple[DependencyEdge, ...]:
    """Return the 'behind' pairs, those with enough support corrected to 'below', by rising ids."""
    config = RelationConfig() if config is None else config
    needed = needed_support(scene.label_image.shape[0], config)
    found: list[DependencyEdge] = []
    for pair in find_adjacencies(scene, config):
        first, second = (support > needed for support in pair.below_support)
        if first != second:
            found.append(_relation(pair, EdgeKind.BELOW, first_is_source=first))
        else:
            found.extend(behind_candidates((pair,)))
    return tuple(found)


def _relation(pair: Adjacency, kind: EdgeKind, first_is_source: bool) -> DependencyEdge:
    s, t = (0, 1) if first_is_source else (1, 0)
    ids = (pair.first, pair.second)
    evidence = {
        "source_depth_m": round(pair.mean_depth_m[s], 4),
        "target_depth_m": round(pair.mean_depth_m[t], 4),
        "source_pixels": pair.pixels[s],
        "target_pixels": pair.pixels[t],
        "below_support": pair.below_support[s],
        "below_support_reversed": pair.below_support[t],
    }
    return DependencyEdge(ids[s], ids[t], kind, evidence=evidence)


def _disk(radius_px: float) -> Int64[np.ndarray, "m 2"]:
    r = int(radius_px)
    rows, cols = np.mgrid[-r : r + 1, -r : r + 1]
    inside = rows**2 + cols**2 <= radius_px**2
    return np.stack([rows[inside], cols[inside]], axis=1).astype(np.int64)


def _point_image(
    scene: SegmentedScene,
) -> tuple[Int32[np.ndarray, "h w"], Float32[np.ndarray, "n 3"], Float32[np.ndarray, "n 3"]]:
    """Return, per pixel, an index into all objects' points (-1: none), those points, and their normals."""
    pixels = np.concatenate([o.pixels for o in scene.objects])
    index = np.full(scene.label_image.shape, -1, dtype=np.int32)
    index[pixels[:, 0], pixels[:, 1]] = np.arange(len(pixels), dtype=np.int32)
    points = np.concatenate([o.points for o in scene.objects])
    normals = np.concatenate([o.normals for o in scene.objects])
    return index, kernel_array(points, np.float32), kernel_array(normals, np.float32)

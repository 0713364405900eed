"""Keep an object's id from snapshot to snapshot.

Most of a scene stays where it was: a surface point that is found again in its place belongs to its earlier object. So
masks are matched to earlier objects by the surface that they share. An object whose surface does not decide, since it
was moved or hidden for a while, is matched by its looks, its size, and where it was.

Masks also change from look to look where nothing moved: two objects become one mask, or one becomes two. Of two such
readings of an unchanged surface, the surer one stays.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, Int64
from scipy import ndimage
from scipy.optimize import linear_sum_assignment

from torc.geometry.transforms import project
from torc.records import BACKGROUND, MAX_OBJECTS, TARGET_ID, KnownObject, Observation, SegmentedScene

_MOST_POINTS = 400


@dataclass(frozen=True)
class TrackingConfig:
    """When an object is an earlier one.

    Attributes:
        same_m, same_share: a point stayed if the depth there is this close to it, or within this share of the depth.
        overlap: least agreement (F of the shared surface) of a mask with the object that stood there.
        part: a mask holds an object, or an object a mask, with this share of its surface.
        reach_m: an object was moved no further than this in one pick.
        alike: least likeness (cosine) of an object that was moved, or was out of sight.
        unlike: an object that stands where another stood, but looks less like it than this, is a different one.
        forget: looks after which an object that is gone from its place is forgotten.
    """

    same_m: float = 0.008
    same_share: float = 0.012
    overlap: float = 0.3
    part: float = 0.6
    reach_m: float = 0.25
    alike: float = 0.6
    unlike: float = 0.2
    forget: int = 2


@dataclass(frozen=True)
class Seen:
    """An object of the present snapshot that has no id yet.

    Surface points are in the world; the look is a unit vector; `sureness`, 0 to 1, says how surely it is one object.
    """

    points: Float32[np.ndarray, "n 3"]
    look: Float32[np.ndarray, "d"]
    sureness: float


def carried_over(
    before: SegmentedScene, observation: Observation, config: TrackingConfig
) -> Int16[np.ndarray, "h w"]:
    """Return, per pixel, the id of the object whose surface was there before and still is; BACKGROUND elsewhere."""
    depth = observation.depth_m
    out = np.full(depth.shape, BACKGROUND, np.int16)
    for o in before.objects:
        rows, cols, kept = _still_there(o.points, observation, config)
        out[rows[kept], cols[kept]] = o.id
    return out


def settled_masks(
    label: Int16[np.ndarray, "h w"],
    sureness: Float32[np.ndarray, "n"],
    before: SegmentedScene,
    carried: Int16[np.ndarray, "h w"],
    config: TrackingConfig,
) -> tuple[Int16[np.ndarray, "h w"], Float32[np.ndarray, "n"]]:
    """Return masks (numbers from 0 on) and their sureness, with the earlier reading restored where it was surer."""
    known = {k.id: k for k in before.known}
    label, sure = label.copy(), list(map(float, sureness))
    table = _Shares(len(sure), label, carried, before)
    for mask in range(len(sureness)):
        held = [k for k in table.held_by(mask, config.part) if k in known]
        if len(held) > 1 and np.mean([known[k].sureness for k in held]) > sure[mask]:
            _divide(label, mask, held, carried, sure, [known[k].sureness for k in held])
    table = _Shares(len(sure), label, carried, before)
    for k, fact in known.items():
        parts = table.parts_of(k, config.part)
        if len(parts) > 1 and fact.sureness > max(sure[m] for m in parts):
            for m in parts[1:]:
                label[label == m] = parts[0]
            sure[parts[0]] = fact.sureness
    return label, np.array(sure, np.float32)


def same_ids(
    seen: Sequence[Seen],
    overlap: Float[np.ndarray, "n k"],
    before: SegmentedScene | None,
    observation: Observation,
    config: TrackingConfig,
) -> tuple[list[int], tuple[KnownObject, ...]]:
    """Return an id for each object, and what to remember of all.

    `overlap` is the agreement of each with each object of `before.objects`, see `agreement`; it has no columns before
    the first snapshot. New objects get ids that nothing known has, and not TARGET_ID.
    """
    ids: list[int | None] = [None] * len(seen)
    remembered = () if before is None else before.known
    overlap = np.where(_unlike(seen, before, config), 0.0, overlap)
    for i, j in zip(*linear_sum_assignment(-overlap)):
        if before is not None and overlap[i, j] >= config.overlap:
            ids[i] = before.objects[j].id
    lost = [k for k in remembered if k.id not in ids]
    for i, k in _found_again(seen, ids, lost, config):
        ids[i] = k.id
    lost = [k for k in lost if k.id not in ids]
    kept = [k for k in (_aged(k, observation, config) for k in lost) if k is not None]
    _name_the_new(ids, kept)
    looks = {k.id: k.looks for k in remembered}
    facts = [
        KnownObject(
            i, s.points[:: max(1, -(-len(s.points) // _MOST_POINTS))], s.look, s.sureness, looks.get(i, 0) + 1
        )
        for s, i in zip(seen, ids, strict=True)
        if i is not None
    ]
    return [i for i in ids if i is not None], tuple(sorted([*facts, *kept], key=lambda k: k.id))


def _unlike(
    seen: Sequence[Seen], before: SegmentedScene | None, config: TrackingConfig
) -> Bool[np.ndarray, "n k"]:
    """Return which of the objects look different from which of the earlier ones."""
    if before is None or not seen:
        return np.zeros((len(seen), 0 if before is None else len(before.objects)), bool)
    looks = {k.id: k.look for k in before.known}
    then = np.stack([looks.get(o.id, seen[0].look) for o in before.objects] or [np.zeros_like(seen[0].look)])
    return np.asarray(np.stack([s.look for s in seen]) @ then.T < config.unlike)[:, : len(before.objects)]


def agreement(
    masks: int, label: Int16[np.ndarray, "h w"], carried: Int16[np.ndarray, "h w"], before: SegmentedScene
) -> Float[np.ndarray, "n k"]:
    """Return how far each mask and each earlier object share one surface: twice what they share, by what both have."""
    table = _Shares(masks, label, carried, before)
    total = table.mask_sizes[:, None] + table.object_sizes
    return np.asarray(2 * table.common / np.maximum(total, 1))


class _Shares:
    """Pixels that masks and the earlier objects have in common; a mask may have none at all."""

    def __init__(self, masks: int, label: np.ndarray, carried: np.ndarray, before: SegmentedScene) -> None:
        self.ids = [o.id for o in before.objects]
        both = (label >= 0) & (carried >= 0)
        table = np.bincount(
            label[both].astype(np.int64) * MAX_OBJECTS + carried[both], minlength=masks * MAX_OBJECTS
        )
        self.common: Int64[np.ndarray, n_k] = table.reshape(masks, MAX_OBJECTS)[:, self.ids]
        self.mask_sizes = np.bincount(label[label >= 0].astype(np.int64), minlength=masks)
        self.object_sizes = np.array([len(o.points) for o in before.objects], dtype=np.int64)

    def held_by(self, mask: int, share: float) -> list[int]:
        """Return ids of the objects that lie in a mask with this share of their surface."""
        inside = self.common[mask] >= share * self.object_sizes
        return [self.ids[j] for j in np.flatnonzero(inside & (self.common[mask] > 0))]

    def parts_of(self, object_id: int, share: float) -> list[int]:
        """Return masks that lie on an object with this share of theirs, the largest first."""
        if object_id not in self.ids:
            return []
        common = self.common[:, self.ids.index(object_id)]
        found = np.flatnonzero((common >= share * self.mask_sizes) & (common > 0))
        return [int(m) for m in sorted(found, key=lambda m: -self.mask_sizes[m])]


def _divide(
    label: np.ndarray,
    mask: int,
    held: list[int],
    carried: np.ndarray,
    sure: list[float],
    readings: list[float],
) -> None:
    """Divide a mask among the objects that it holds: each pixel goes to the nearest pixel that stayed."""
    inside = label == mask
    source = np.where(inside & np.isin(carried, held), carried, BACKGROUND)
    rows, cols = ndimage.distance_transform_edt(source < 0, return_distances=False, return_indices=True)
    nearest = source[rows, cols]
    sure[mask] = readings[0]
    for k, reading in zip(held[1:], readings[1:], strict=True):
        label[inside & (nearest == k)] = len(sure)
        sure.append(reading)


def _still_there(
    points: Float32[np.ndarray, "n 3"], observation: Observation, config: TrackingConfig
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rows and columns where points would show, and whether the depth there is theirs."""
    rows, cols, z, inside = _places(points, observation)
    found = observation.depth_m[rows, cols]
    near = np.abs(found - z) < np.maximum(config.same_m, config.same_share * z)
    return rows, cols, inside & (found > 0) & near


def _places(
    points: Float32[np.ndarray, "n 3"], observation: Observation
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    height, width = observation.depth_m.shape
    x, y, z = project(points.astype(float), observation.K, observation.T_world_camera)
    inside = (z > 0) & (x > -0.5) & (y > -0.5) & (x < width - 0.5) & (y < height - 0.5)
    cols, rows = (np.where(inside, np.rint(v), 0).astype(np.int64) for v in (x, y))
    return rows, cols, z, inside


def _found_again(
    seen: Sequence[Seen], ids: list[int | None], lost: list[KnownObject], config: TrackingConfig
) -> list[tuple[int, KnownObject]]:
    """Match objects without an id to lost ones: alike, of about their size, and not too far away."""
    new = [i for i, k in enumerate(ids) if k is None]
    if not new or not lost:
        return []
    likeness = np.array([[_likeness(seen[i], k, config) for k in lost] for i in new])
    pairs = zip(*linear_sum_assignment(-likeness))
    return [(new[i], lost[j]) for i, j in pairs if likeness[i, j] >= config.alike]


def _likeness(seen: Seen, known: KnownObject, config: TrackingConfig) -> float:
    """Return the cosine of the looks, less for other sizes and for the distance; 0 beyond the reach."""
    away = float(np.linalg.norm(seen.points.mean(axis=0) - known.points.mean(axis=0)))
    if away > config.reach_m:
        return 0.0
    now, then = (float(np.linalg.norm(np.ptp(p, axis=0))) for p in (seen.points, known.points))
    size = min(now, then) / max(now, then, 1e-6)
    return float(seen.look @ known.look) * min(1.0, 0.5 + size) - 0.2 * away / config.reach_m


def _aged(known: KnownObject, observation: Observation, config: TrackingConfig) -> KnownObject | None:
    """Return the memory of an object that was not found; None once it is certainly gone."""
    rows, cols, z, inside = _places(known.points, observation)
    found = observation.depth_m[rows, cols]
    margin = np.maximum(config.same_m, config.same_share * z)
    # Something in front, or no reading, hides it; something behind shows that it is not there.
    gone = inside & (found > z + margin)
    share = float(np.count_nonzero(gone)) / max(len(z), 1)
    if share > 0.5 and known.missed + 1 >= config.forget:
        return None
    return replace(known, missed=known.missed + 1)


def _name_the_new(ids: list[int | None], kept: list[KnownObject]) -> None:
    """Give ids to objects without one, in place: the lowest free one, else that of the object missed longest."""
    taken = {k for k in ids if k is not None} | {k.id for k in kept} | {TARGET_ID}
    free = [k for k in range(MAX_OBJECTS) if k not in taken]
    kept.sort(key=lambda k: (not k.is_target, k.missed))  # the target is forgotten last
    for i, k in enumerate(ids):
        if k is None:
            while not free and kept:
                free.append(kept.pop().id)
            ids[i] = free.pop(0)

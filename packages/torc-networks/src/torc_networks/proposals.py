"""Choose the objects among overlapping masks, and give each pixel one number.

A network that is asked for "object" also finds the table, the robot's arm, parts of things, heaps, and some things
twice. The rules, in this order:

1. Drop a mask that is tiny, too large, or does not mostly rise from the support within the workspace.
2. Of two masks that are nearly the same, keep the one with the higher score; of equal scores, the smaller one.
3. Drop a mask that two or more others inside it fill by half: it is a heap of these.
4. Drop a mask inside one with a higher score, unless it is called the target: it is a part of that.
5. Where masks still overlap, the smaller one lies on top; of equal ones, the surer one. Drop one that loses most of its
   pixels.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Int64

from torc import InputError, Observation
from torc.perception.embedded.inputs import View, rising
from torc.perception.from_masks import Masks
from torc.perception.segmentation import PerceptionConfig, valid_depth
from torc.workspace.description import Workspace


@dataclass(frozen=True)
class Proposals:
    """Masks that a network takes for objects.

    Attributes:
        masks: may overlap.
        scores: how surely each is an object, 0 to 1; NaN for not at all.
        wanted_p: how surely each is the target, by its description; 0 for those that it does not describe.
    """

    masks: Bool[np.ndarray, "n h w"]
    scores: Float32[np.ndarray, "n"]
    wanted_p: Float32[np.ndarray, "n"]

    def __getitem__(self, kept: np.ndarray) -> "Proposals":
        """Return those at these indices."""
        return Proposals(self.masks[kept], self.scores[kept], self.wanted_p[kept])


@dataclass(frozen=True)
class LayoutConfig:
    """Which masks are objects; see the rules above.

    Attributes:
        min_pixels: smaller masks are dropped.
        most_share: masks that cover a larger share of the picture, such as the table, are dropped.
        rising_share: this share of a mask's depth readings must rise from the support, within the workspace.
        same_iou: masks with a larger intersection over union show the same thing.
        inside: a mask is inside a larger one if this share of its pixels is.
        filled: masks that fill this share of a larger one make it a heap.
        left: share of its pixels that a mask must keep from those on top of it.
    """

    min_pixels: int = 30
    most_share: float = 0.3
    rising_share: float = 0.5
    same_iou: float = 0.7
    inside: float = 0.8
    filled: float = 0.5
    left: float = 0.5

    def __post_init__(self) -> None:
        shares = (self.most_share, self.rising_share, self.same_iou, self.inside, self.filled, self.left)
        if self.min_pixels < 1 or not all(0 <= share <= 1 for share in shares):
            raise InputError(
                "A layout's min_pixels must be at least 1; most_share, rising_share, same_iou, inside, filled and left "
                "must be from 0 to 1."
            )


def objects_among(
    found: Proposals,
    observation: Observation,
    workspace: Workspace,
    clouds: PerceptionConfig,
    config: LayoutConfig,
) -> Masks:
    """Return the objects among the masks of a picture, by all the rules."""
    depth = valid_depth(observation.depth_m, clouds.min_depth_m, clouds.max_depth_m).astype(np.float32)
    pose = observation.T_world_camera
    view = View(observation.rgb, depth, observation.K, pose, workspace.support_z_m)
    return lay_out(plausible(found, depth > 0, rising(view, workspace.grid), config), config)


def plausible(
    proposals: Proposals,
    read: Bool[np.ndarray, "h w"],
    rises: Bool[np.ndarray, "h w"],
    config: LayoutConfig,
) -> Proposals:
    """Apply rule 1. `read`: pixels with a depth reading; `rises`: those of what rises from the support, as `rising` has
    them.
    """
    masks = proposals.masks
    sizes, readings, rising = (np.count_nonzero(m, axis=(1, 2)) for m in (masks, masks & read, masks & rises))
    good = (sizes >= config.min_pixels) & (sizes <= config.most_share * read.size)
    good &= (readings > 0) & (rising >= config.rising_share * readings)
    return proposals[np.flatnonzero(good & np.isfinite(proposals.scores))]


def lay_out(proposals: Proposals, config: LayoutConfig) -> Masks:
    """Apply rules 2 to 5. The mask with the most pixels gets number 0; a mask's sureness is its score."""
    found = _without_parts(_without_doubles(proposals, config), config)
    sizes = np.count_nonzero(found.masks, axis=(1, 2))
    label = np.full(found.masks.shape[1:], -1, np.int16)
    for k in np.lexsort((found.scores, -sizes)):
        label[found.masks[k]] = k
    pixels = np.bincount(label[label >= 0].astype(np.int64), minlength=len(sizes))
    good = pixels >= np.maximum(config.left * sizes, config.min_pixels)
    order = np.lexsort((-found.scores, -pixels))
    order = order[good[order]]
    number = np.full(len(sizes) + 1, -1, np.int16)
    number[order] = np.arange(len(order))
    label, found = number[label], found[order]
    # The last one is of pixels without a mask.
    return Masks(label, found.scores, np.append(found.wanted_p, np.float32(0))[label])


def _without_doubles(proposals: Proposals, config: LayoutConfig) -> Proposals:
    """Apply rule 2. A mask that stays is the target as surely as its doubles are."""
    common = shared_pixels(proposals.masks)
    sizes = np.diagonal(common)
    wanted_p = proposals.wanted_p.copy()
    kept: list[int] = []
    for k in np.lexsort((sizes, -proposals.scores)):
        union = sizes[k] + sizes[kept] - common[k, kept]
        iou = common[k, kept] / np.maximum(union, 1)
        if len(kept) and iou.max() > config.same_iou:
            same = kept[int(np.argmax(iou))]
            wanted_p[same] = max(wanted_p[same], wanted_p[k])
        else:
            kept.append(int(k))
    kept.sort()
    return Proposals(proposals.masks[kept], proposals.scores[kept], wanted_p[kept])


def _without_parts(proposals: Proposals, config: LayoutConfig) -> Proposals:
    """Apply rules 3 and 4."""
    common = shared_pixels(proposals.masks)
    sizes = np.diagonal(common)
    inside = (common >= config.inside * sizes[:, None]) & (sizes[:, None] < sizes)
    heap = np.zeros(len(sizes), bool)
    for k, mask in enumerate(proposals.masks):
        within = np.flatnonzero(inside[:, k])
        if len(within) >= 2:
            filled = np.count_nonzero(proposals.masks[within].any(axis=0) & mask)
            heap[k] = filled >= config.filled * sizes[k]
    surer = proposals.scores > proposals.scores[:, None]
    part = (inside & surer & ~heap).any(axis=1) & (proposals.wanted_p == 0)
    return proposals[np.flatnonzero(~heap & ~part)]


def shared_pixels(masks: Bool[np.ndarray, "n h w"]) -> Int64[np.ndarray, "n n"]:
    """Return how many pixels each two masks have in common."""
    bits = np.packbits(masks.reshape(len(masks), masks.shape[1] * masks.shape[2]), axis=1)
    words = np.pad(bits, ((0, 0), (0, -bits.shape[1] % 8))).view(np.uint64)
    rows = [np.bitwise_count(words & w).sum(axis=1, dtype=np.int64) for w in words]
    return np.array(rows, np.int64).reshape(len(masks), len(masks))

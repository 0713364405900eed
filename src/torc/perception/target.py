"""Decide which of the masks is the target, by reference pictures; it may be none of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int16, UInt8
from PIL import Image

from torc.errors import InputError
from torc.geometry.extent import Extent, extent
from torc.io.pictures import eight_bit_picture
from torc.records import KnownObject


@dataclass(frozen=True)
class Certainty:
    """When the likeliest of several masks is taken for the target.

    Attributes:
        sure: a mask is the target from this probability on.
        still: a mask that was the target stays it down to this probability.
        ahead: the best mask is the target only if the second best is this much less probable.
    """

    sure: float = 0.7
    still: float = 0.15
    ahead: float = 0.15

    def __post_init__(self) -> None:
        if not 0 <= self.still <= self.sure <= 1:
            raise InputError(f"{type(self).__name__}: probabilities, `still` not above `sure`.")


@dataclass(frozen=True)
class TargetConfig(Certainty):
    """When a mask is taken for the target by reference pictures.

    The numbers were chosen by `python -m tools.eyes target` and `held`: a wrong object costs the trial, a target that
    is not recognised yet a pick or two.

    Attributes:
        likeness, steepness, pixels: a lone mask with this cosine to the nearest reference picture is the target with
            probability 1/2; how fast that changes with the cosine; how much it changes with the logarithm of the number
            of pixels.
        too_long, too_thick: if the target's size is known, how fast the odds fall, per unit of the logarithm, as a mask
            is longer or thicker. Shorter and thinner proves nothing: many are partly hidden.
        held_likeness, held_steepness, held_trust: likewise for the held object, and the weight of the log-odds from
            before the pick.
        held_too_large: how fast its odds fall as it is longer or thicker than the target, as above. Nothing hides it,
            and the gripper only makes it smaller, so this is steep.
    """

    sure: float = 0.8
    likeness: float = 0.54
    steepness: float = 13.4
    pixels: float = 0.38
    too_long: float = 3.1
    too_thick: float = 10.0
    held_likeness: float = 0.72
    held_steepness: float = 9.3
    held_trust: float = 0.79
    held_too_large: float = 15.0


_FLYING = 0.02
"""Share of an object's points that may be flying points at edges."""
_LEAST_M = 0.005
_TYPICAL_PIXELS = 1000.0
_LEAST_P = 0.005
"""Limits how sure the belief before the pick counts, either way."""
_NEAR_PX = 4
MAX_PICTURES = 24
_MAX_SIDE_PX = 1024
_LEAST_AGREEMENT = 0.2


def size_in_sight(points: Float[np.ndarray, "n 3"]) -> Extent:
    """Return length and thickness of a cloud, metres: least values, since hidden parts are missing."""
    return extent(points, _FLYING)


def stretch(seen_m: Sequence[tuple[float, float]], told_m: tuple[float, float]) -> Float[np.ndarray, "n 2"]:
    """Return logarithms of how much longer and thicker things look than the target is."""
    sizes_m = np.array(seen_m).reshape(-1, 2)
    return np.asarray(np.log(np.maximum(sizes_m, _LEAST_M) / np.maximum(told_m, _LEAST_M)))


def target_probabilities(
    looks: Float32[np.ndarray, "n d"],
    pixels: Sequence[int],
    references: Float32[np.ndarray, "m d"],
    config: TargetConfig,
    stretched: Float[np.ndarray, "n 2"] | None = None,
    brought_odds: float = 0.0,
) -> Float[np.ndarray, "n"]:
    """Return the probability of each object to be the one on the reference pictures; at most one of them is.

    A softmax over all of them, none, and what was delivered before (`SegmentedScene.brought_odds`). Looks are unit
    vectors; `stretched` is that of `stretch`, None if the target's size is unknown.
    """
    if len(looks) == 0:
        return np.zeros(0)
    cosine = (looks @ references.T).max(axis=1)
    size = np.log(np.maximum(np.asarray(pixels, float), 1) / _TYPICAL_PIXELS)
    score = config.steepness * (cosine - config.likeness) + config.pixels * size
    if stretched is not None:
        score -= np.maximum(stretched, 0) @ (config.too_long, config.too_thick)
    odds = np.exp(score)
    return np.asarray(odds / (1 + brought_odds + odds.sum()))


def held_probability(
    cosine: float,
    before: float,
    config: TargetConfig,
    stretched: Float[np.ndarray, "2"] | None = None,
    rivals: float = 0.0,
) -> float:
    """Return the probability that an object in the hand is the target.

    By the cosine to the nearest reference picture, the probability `before` the pick, how much larger it is than the
    target (`stretch`; None if that is unknown), and how many others its looks fit equally well (`rivals`).
    """
    before = min(max(before, _LEAST_P), 1 - _LEAST_P)
    odds = config.held_steepness * (cosine - config.held_likeness) + config.held_trust * np.log(
        before / (1 - before)
    )
    if stretched is not None:
        odds -= config.held_too_large * float(np.maximum(stretched, 0).sum())
    return float(1 / (1 + np.exp(-odds) + rivals))


def rivals(known: Sequence[KnownObject], object_id: int, config: TargetConfig) -> float:
    """Return how many other objects may equally be the target, by what was seen before this one is picked.

    Each counts by how surely it looks alike (on the scale of reference pictures), and less if it is less likely. A
    likelier one counts as an equal: it may only have been seen better than the one now in the hand.
    """
    own = next((k for k in known if k.id == object_id), None)
    others = [k for k in known if k.id != object_id]
    if own is None or not others:
        return 0.0
    cosine = np.stack([k.look for k in others]) @ own.look
    same = 1 / (1 + np.exp(-config.held_steepness * (cosine - config.held_likeness)))
    share = np.array([k.target_p for k in others]) / max(own.target_p, _LEAST_P)
    return float(same @ np.minimum(share, 1))


def choose_target(p: Float[np.ndarray, "n"], was: int | None, config: Certainty) -> int | None:
    """Return the index of the target among the objects, or None. `was` is the earlier target, if still there."""
    if len(p) == 0:
        return None
    order = np.argsort(-p)
    best = int(order[0])
    second = float(p[order[1]]) if len(p) > 1 else 0.0
    if (
        was is not None
        and p[was] >= config.still
        and not (best != was and p[best] >= config.sure + config.ahead)
    ):
        return was
    return best if p[best] >= config.sure and p[best] - second >= config.ahead else None


def marked_object(label: Int16[np.ndarray, "h w"], mark: tuple[int, ...]) -> int | None:
    """Return the label (0 or more) at a mark, or None. Raises InputError off the picture.

    At a pixel (column, row), or else nearest to it within a few pixels; or the one that agrees best with a box (left,
    top, right, bottom).
    """
    height, width = label.shape
    x, y = mark[:2]
    if not (0 <= x < width and 0 <= y < height):
        raise InputError(f"The mark {mark} lies off the picture, which is {width}x{height} pixels.")
    if len(mark) == 4:
        inside = label[y : mark[3], x : mark[2]]
        counts = np.bincount(inside[inside >= 0].astype(np.int64), minlength=1)
        sizes = np.bincount(label[label >= 0].astype(np.int64), minlength=len(counts))[: len(counts)]
        agree = counts / np.maximum(sizes + inside.size - counts, 1)
        return int(np.argmax(agree)) if agree.max() > _LEAST_AGREEMENT else None
    top, left = max(y - _NEAR_PX, 0), max(x - _NEAR_PX, 0)
    rows, cols = np.nonzero(label[top : y + _NEAR_PX + 1, left : x + _NEAR_PX + 1] >= 0)
    if len(rows) == 0:
        return None
    rows, cols = rows + top, cols + left
    nearest = int(np.argmin((rows - y) ** 2 + (cols - x) ** 2))
    return int(label[rows[nearest], cols[nearest]])


def load_pictures(paths: Sequence[Path]) -> tuple[UInt8[np.ndarray, "h w c"], ...]:
    """Load reference pictures from files, as RGBA if they have an alpha channel.

    Raises InputError for one that cannot be read, or shows nothing, and for more than MAX_PICTURES.
    """
    if len(paths) > MAX_PICTURES:
        raise InputError(
            f"{len(paths)} reference pictures are given; {MAX_PICTURES} from different sides are enough."
        )
    pictures = []
    for path in paths:
        try:
            with Image.open(path) as opened:
                image = eight_bit_picture(opened)
                if max(image.size) > _MAX_SIDE_PX:
                    image.thumbnail((_MAX_SIDE_PX, _MAX_SIDE_PX))
                picture = np.array(image.convert("RGBA" if image.has_transparency_data else "RGB"))
        except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            raise InputError(f"Cannot read the reference picture {path}: {error}.") from error
        try:
            reference_mask(picture)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        pictures.append(picture)
    return tuple(pictures)


def reference_mask(picture: UInt8[np.ndarray, "h w c"]) -> Bool[np.ndarray, "h w"]:
    """Return where a reference picture shows the target: its alpha channel if used, else what stands out from the rim.

    Raises InputError if the picture is not valid, or shows nothing.
    """
    if picture.ndim != 3 or picture.shape[2] not in (3, 4) or min(picture.shape[:2]) < 8:
        raise InputError(
            f"A reference picture is at least 8x8 pixels of RGB or RGBA, not of shape {picture.shape}."
        )
    cut_out = (
        picture.shape[2] == 4 and picture[..., 3].min() < 128
    )  # screenshots have a meaningless alpha channel
    mask = picture[..., 3] > 127 if cut_out else _standing_out(np.ascontiguousarray(picture[..., :3]))
    if np.count_nonzero(mask) < 30:
        raise InputError(
            "A reference picture shows no object: give one that fills the picture, or a mask as alpha."
        )
    return np.asarray(mask)


def _standing_out(picture: UInt8[np.ndarray, "h w 3"]) -> Bool[np.ndarray, "h w"]:
    height, width = picture.shape[:2]
    shrink = min(1.0, 200 / max(height, width))
    small = cv2.resize(picture, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    h, w = small.shape[:2]
    rim = max(1, round(0.04 * min(h, w)))
    mask = np.full((h, w), cv2.GC_PR_FGD, np.uint8)
    mask[:rim], mask[h - rim :], mask[:, :rim], mask[:, w - rim :] = (cv2.GC_BGD,) * 4
    found = grab_cut(small, mask, rounds=4)
    if found.mean() < 0.05:  # everything is alike: then all of it is the object
        found = np.ones((h, w), bool)
    return np.asarray(cv2.resize(found.view(np.uint8), (width, height), interpolation=cv2.INTER_NEAREST) > 0)


def grab_cut(
    rgb: UInt8[np.ndarray, "h w 3"], marks: UInt8[np.ndarray, "h w"], rounds: int
) -> Bool[np.ndarray, "h w"]:
    """Return what belongs to the marked foreground by colour (Rother et al. 2004).

    `marks` are OpenCV's: GC_FGD and GC_BGD are certain, GC_PR_FGD and GC_PR_BGD a guess. They are overwritten.
    """
    cv2.setRNGSeed(0)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(np.ascontiguousarray(rgb), marks, (0, 0, 1, 1), *models, rounds, cv2.GC_INIT_WITH_MASK)
    return np.isin(marks, (cv2.GC_FGD, cv2.GC_PR_FGD))

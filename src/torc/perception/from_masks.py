"""Turn masks into a scene, whatever made the masks: stable ids, clouds, the target.

`embedded` and all perceptions that find objects by their own network build on this.
"""

import inspect
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from jaxtyping import Bool, Float, Float32, Int16

from torc.errors import PartError
from torc.geometry.extent import Extent
from torc.geometry.transforms import kernel_array, masked_points
from torc.parallel import each, shares
from torc.perception.embedded.inputs import NOISE, support_roughness
from torc.perception.embedded.model import crop, describe
from torc.perception.image_kernels import count_labels, looked_up
from torc.perception.protocol import Wanted
from torc.perception.segmentation import REAL_CAMERA, PerceptionConfig, segment, valid_depth
from torc.perception.target import (
    Certainty,
    TargetConfig,
    choose_target,
    held_probability,
    marked_object,
    reference_mask,
    rivals,
    size_in_sight,
    stretch,
    target_probabilities,
)
from torc.perception.tracking import Seen, TrackingConfig, agreement, carried_over, same_ids, settled_masks
from torc.records import BACKGROUND, MAX_OBJECTS, KnownObject, Observation, SegmentedScene
from torc.registry.kinds import PerceptionTraits
from torc.registry.loading import kind_of_value
from torc.registry.settings import ConfigTraits
from torc.workspace.description import Workspace
from torc.workspace.workspace_files import load_workspace

_EXACT = replace(PerceptionConfig(), rim_px=2, piece_px=5)
"""Masks are a pixel or two off, whatever the depth: there they hold readings of what lies behind."""
_HELD = 1
"""Label of the held object; 0, a given target's, has its own rules."""


@dataclass(frozen=True)
class FromMasksConfig(ConfigTraits):
    """How a scene is made, whatever finds the masks.

    Attributes:
        clouds: how clouds are made from masks and depth.
        tracking: when an object is an earlier one.
        target: when a mask is taken for the target, by reference pictures.
        threads: of the networks on the processor.
    """

    clouds: PerceptionConfig = _EXACT
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    target: TargetConfig = field(default_factory=TargetConfig)
    threads: int = 1

    @classmethod
    def rough(cls) -> Self:
        """Return the settings for depth with a sensor's errors."""
        return cls(clouds=REAL_CAMERA)


@dataclass(frozen=True)
class Masks:
    """Masks of one picture.

    Attributes:
        label: number of the mask per pixel, from 0 on; -1 for none.
        sureness: per mask, how surely it is one object, 0 to 1.
        wanted_p: per pixel, the probability that it shows the target, by its description; None if no words were read.
    """

    label: Int16[np.ndarray, "h w"]
    sureness: Float32[np.ndarray, "n"]
    wanted_p: Float32[np.ndarray, "h w"] | None = None


def mask_faults(masks: Any, observation: Observation) -> Iterator[str]:
    """Yield the reasons why something is not `Masks` of a picture."""
    if not isinstance(masks, Masks):
        yield f"it returned {kind_of_value(masks)}, not Masks"
        return
    label, sureness, shape = masks.label, masks.sureness, observation.depth_m.shape
    if not isinstance(label, np.ndarray) or label.shape != shape or label.dtype.kind != "i":
        yield f"label is {_array_text(label)}; it must be {shape}, as the picture is, of whole numbers (int16)"
    elif label.min() < BACKGROUND:
        yield f"label has {int(label.min())}; it is {BACKGROUND} where there is no mask, and a mask's number elsewhere"
    elif not isinstance(sureness, np.ndarray) or sureness.ndim != 1 or len(sureness) <= label.max():
        yield f"sureness is {_array_text(sureness)}; label numbers {int(label.max()) + 1} masks from 0 on"
    if masks.wanted_p is not None and getattr(masks.wanted_p, "shape", None) != shape:
        yield f"wanted_p is {_array_text(masks.wanted_p)}; it must be {shape}, as the picture is, or None"


def _array_text(value: Any) -> str:
    return f"{value.shape} {value.dtype}" if isinstance(value, np.ndarray) else kind_of_value(value)


class FromMasks(ABC, PerceptionTraits):
    """A perception that finds masks and leaves the rest to torc. Subclasses find the masks."""

    config: FromMasksConfig = FromMasksConfig()
    words: Certainty = Certainty()
    """How sure words must be; for subclasses that read them."""
    _references: tuple[tuple[int, ...], Float32[np.ndarray, "m d"]] | None = None

    def __init__(self, config: FromMasksConfig | None = None, workspace: Workspace | None = None) -> None:
        if config is not None:
            self.config = config
        if workspace is not None:
            self.workspace = workspace

    @cached_property
    def workspace(self) -> Workspace:
        """Table, bin and camera; the default workspace if none was given."""
        return load_workspace()

    @abstractmethod
    def find(self, observation: Observation, wanted: Wanted) -> Masks:
        """Return the masks of the objects in one picture, whatever there was before."""

    def perceive(
        self, observation: Observation, wanted: Wanted, before: SegmentedScene | None
    ) -> SegmentedScene:
        """Return the objects.

        The target comes from the mark in the first picture; else from reference pictures; else from words, if the
        masks' maker reads them; else it is not in sight. Raises InputError for reference pictures that show nothing,
        and MissingDependencyError without onnxruntime.
        """
        config, made = self.config, self.find(observation, wanted)
        if faults := [*mask_faults(made, observation)]:
            code = inspect.unwrap(type(self).find).__code__
            raise PartError(
                f"{type(self).__name__}.find ({code.co_filename}, line {code.co_firstlineno}): {'; '.join(faults)}. "
                "docs/extending.md lists the fields of Masks."
            )
        label = without_fixed(made.label, observation, self.workspace, config.clouds)
        label = kernel_array(label, np.int16)
        sureness = made.sureness
        carried = None if before is None else carried_over(before, observation, config.tracking)
        if before is not None and carried is not None:
            label, sureness = settled_masks(label, sureness, before, carried, config.tracking)
        label, sureness = _at_most(label, sureness, MAX_OBJECTS - 1)
        # No object has the id 0: it stands for a target that was not seen yet.
        shifted = label + (label >= 0)
        found = segment(observation, shifted, config.clouds)
        masks = [o.id - 1 for o in found.objects]
        looks = _looks(observation, label, masks, config.threads)
        seen = [
            Seen(o.points, look, float(sureness[m]))
            for o, look, m in zip(found.objects, looks, masks, strict=True)
        ]
        overlap = np.zeros((len(seen), 0))
        if before is not None and carried is not None:
            overlap = agreement(len(sureness), label, carried, before)[masks]
        ids, known = same_ids(seen, overlap, before, observation, config.tracking)
        brought_odds = 0.0 if before is None else before.brought_odds
        p = None
        if wanted.pictures:
            p = self._target_p(found, looks, wanted, brought_odds)
        elif made.wanted_p is not None:
            p = by_words(label, made.wanted_p, masks)
        was_id = None if before is None else before.target_number
        was = ids.index(was_id) if was_id in ids else None
        target = was if p is None else choose_target(p, was, config.target if wanted.pictures else self.words)
        if wanted.mark and before is None:
            marked = marked_object(label, wanted.mark)
            target = masks.index(marked) if marked in masks else None
        chances = {} if p is None else dict(zip(ids, map(float, p), strict=True))
        known = tuple(replace(k, target_p=chances.get(k.id, k.target_p)) for k in known)
        scene = _named(found, ids, known).with_target(None if target is None else ids[target])
        return replace(scene, brought_odds=brought_odds)

    def recognise(
        self,
        observation: Observation,
        mask: Bool[np.ndarray, "h w"],
        wanted: Wanted,
        scene: SegmentedScene,
        object_id: int,
    ) -> float | None:
        """Return the probability that the object in the hand is the target, by reference pictures; None without them.

        If nothing of it can be seen, the probability before the pick.
        """
        if not wanted.pictures:
            return None
        before = {k.id: k.target_p for k in scene.known}.get(object_id, 0.0)
        if not mask.any():
            return before
        look = describe(crop(observation.rgb, mask)[None], self.config.threads)
        cosine = float((look @ self._described(wanted).T).max())
        stretched = None
        if wanted.size_m is not None:
            stretched = stretch([self.size_in_hand(observation, mask)], wanted.size_m)[0]
        config = self.config.target
        return held_probability(cosine, before, config, stretched, rivals(scene.known, object_id, config))

    def size_in_hand(self, observation: Observation, mask: Bool[np.ndarray, "h w"]) -> Extent:
        """Return the least size of what the mask shows; zero without readings."""
        label = np.where(mask, _HELD, BACKGROUND).astype(np.int16)
        clouds = [o.points for o in segment(observation, label, self.config.clouds).objects]
        return size_in_sight(clouds[0] if clouds else np.zeros((0, 3)))

    def _target_p(
        self, found: SegmentedScene, looks: Float32[np.ndarray, "n d"], wanted: Wanted, brought_odds: float
    ) -> Float[np.ndarray, "n"]:
        """Return the probability of each object in sight to be the target, by reference pictures."""
        pixels, stretched = [o.pixel_count for o in found.objects], None
        if wanted.size_m is not None:
            sizes_m = each(size_in_sight, [o.points for o in found.objects])
            stretched = stretch(sizes_m, wanted.size_m)
        references = self._described(wanted)
        return target_probabilities(looks, pixels, references, self.config.target, stretched, brought_odds)

    def _described(self, wanted: Wanted) -> Float32[np.ndarray, "m d"]:
        """Describe the target on each reference picture; a set of pictures is described once."""
        key = tuple(map(id, wanted.pictures))
        if self._references is None or self._references[0] != key:
            crops = np.stack([crop(p[..., :3], reference_mask(p)) for p in wanted.pictures])
            self._references = key, describe(crops, self.config.threads)
        return self._references[1]


def by_words(
    label: Int16[np.ndarray, "h w"], wanted_p: Float32[np.ndarray, "h w"], masks: Sequence[int]
) -> Float[np.ndarray, "n"]:
    """Return, per mask, the mean probability that its pixels show the target; words may be read for other masks."""
    inside = label >= 0
    number = label[inside].astype(np.int64)
    count = int(label.max(initial=-1)) + 1
    sums = np.bincount(number, weights=wanted_p[inside], minlength=count)
    sizes = np.bincount(number, minlength=count)
    return np.asarray(sums / np.maximum(sizes, 1))[list(masks)]


def _looks(
    observation: Observation, label: Int16[np.ndarray, "h w"], masks: list[int], threads: int
) -> Float32[np.ndarray, "n d"]:
    if not masks:
        return np.zeros((0, 1), np.float32)
    looks = each(
        lambda some: describe(np.stack([crop(observation.rgb, label == m) for m in masks[some]]), threads),
        shares(len(masks)),
    )
    return np.concatenate(looks)


def _at_most(
    label: Int16[np.ndarray, "h w"], sureness: Float32[np.ndarray, "n"], most: int
) -> tuple[Int16[np.ndarray, "h w"], Float32[np.ndarray, "n"]]:
    """Keep at most that many masks, the largest, numbered from 0 on."""
    sizes = count_labels(label, len(sureness))
    order = np.argsort(-sizes, kind="stable")[:most]
    order = order[sizes[order] > 0]
    number = np.full(len(sizes) + 1, -1, np.int16)
    number[order] = np.arange(len(order))
    return looked_up(number, label), sureness[order]


def _named(found: SegmentedScene, ids: list[int], known: tuple[KnownObject, ...]) -> SegmentedScene:
    """Return the scene with these ids for its objects."""
    # Masks without an object are background; numbers below 0 are looked up from the end, and stay.
    table = np.append(np.full(MAX_OBJECTS, BACKGROUND, np.int16), np.arange(-2, 0, dtype=np.int16))
    for o, k in zip(found.objects, ids, strict=True):
        table[o.id] = k
    objects = sorted((replace(o, id=k) for o, k in zip(found.objects, ids, strict=True)), key=lambda o: o.id)
    return replace(
        found,
        label_image=looked_up(table, found.label_image),
        objects=tuple(objects),
        target_id=None,
        known=known,
    )


_NEAR_M = 0.006
"""A reading this close to an obstacle, or inside it, shows the obstacle; with rough depth, farther off."""
_MOST = 0.5
"""A mask is not an object if a larger share of its readings shows obstacles."""


def without_fixed(
    label: Int16[np.ndarray, "h w"], observation: Observation, workspace: Workspace, config: PerceptionConfig
) -> Int16[np.ndarray, "h w"]:
    """Drop the masks that mostly show the workspace's obstacles. -1 means no mask; the other numbers are kept.

    A picture with an estimated pose shows another world, in which no obstacles are known.
    """
    if not workspace.obstacles or observation.pose_estimated:
        return label
    depth_m = valid_depth(observation.depth_m, config.min_depth_m, config.max_depth_m)
    points = masked_points(depth_m > 0, depth_m, observation.K, observation.T_world_camera)
    near_m = max(_NEAR_M, NOISE * support_roughness(points[:, 2] - workspace.support_z_m))
    shown = label[depth_m > 0]
    masked, count = shown >= 0, int(label.max(initial=-1)) + 1
    readings = np.bincount(shown[masked], minlength=count)
    inside = np.zeros(len(points), bool)
    for box in workspace.obstacles:
        inside |= (np.abs(points - box.center) <= np.array(box.size) / 2 + near_m).all(axis=1)
    on_them = np.bincount(shown[masked & inside], minlength=count)
    fixed = np.flatnonzero(on_them > _MOST * readings)
    return np.where(np.isin(label, fixed), np.int16(-1), label)

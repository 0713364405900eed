"""From a file's own labels to object ids: the target is 0, and labels 1..63 keep their numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16

from torc.errors import InputError
from torc.pipeline.frames.record import HIDDEN, RawFrame
from torc.records import BACKGROUND, MAX_OBJECTS, ROBOT, TARGET_ID


@dataclass(frozen=True)
class LabelIds:
    """What a file's labels are called here.

    Attributes:
        ids: object id per label.
        target_visible: whether one of them is the target's.
        label_image: object id per pixel, BACKGROUND and ROBOT elsewhere.
    """

    ids: Mapping[int, int]
    target_visible: bool
    label_image: Int16[np.ndarray, "h w"]


def label_ids(raw: RawFrame) -> LabelIds:
    """Object ids for the labels of a file: the target becomes 0, others keep 1..63 or get the lowest id that is free.

    Raises InputError for labels without an object, negative ones, too many, and a target that is not among them.
    """
    background, robot = raw.settings.background, raw.settings.robot
    if background is None:
        background = BACKGROUND if (raw.labels < 0).any() else 0
    present = sorted(set(np.unique(raw.labels).tolist()) - {background, robot})
    if not present:
        raise InputError(
            f"{raw.where}: labels are {background} (background) everywhere, so there is no object. Give one number per "
            "instance, and `background` if it is another number."
        )
    if present[0] < 0:
        raise InputError(
            f"{raw.where}: label {present[0]} is negative; say which is `background` and which `robot`."
        )
    target = _target_label(raw, present)
    ids = _numbered(raw, present, target)
    values, inverse = np.unique(raw.labels, return_inverse=True)
    new = [ids.get(v, ROBOT if v == robot else BACKGROUND) for v in values.tolist()]
    label_image = np.array(new, dtype=np.int16)[inverse].reshape(raw.labels.shape)
    return LabelIds(ids, target is not None, label_image)


def _target_label(raw: RawFrame, present: list[int]) -> int | None:
    """The target's label, None if it is hidden."""
    given, where = raw.settings.target, f"{raw.where}, key target"
    if given is None and 0 in present:
        return 0
    if given is None:
        raise InputError(
            f"{raw.where}: there is no target. Give the target's label, one of {present[:20]}, or '{HIDDEN}' if it is "
            "not in sight."
        )
    if given == HIDDEN:
        return None
    if isinstance(given, str):
        names = raw.settings.names
        named = [k for k, name in names.items() if name == given]
        if not named:
            raise InputError(
                f"{where}: '{given}' is neither '{HIDDEN}' nor one of the names {sorted(names.values())}. "
                "Give the target's label."
            )
        given = named[0]
    if isinstance(given, bool) or not isinstance(given, int):
        raise InputError(f"{where}: {given!r} is not a whole number.")
    if given not in present:
        raise InputError(
            f"{where}: label {given} has no pixel; the labels are {present[:20]}. If the target is not in "
            f"sight, say '{HIDDEN}'."
        )
    return given


def _numbered(raw: RawFrame, present: list[int], target: int | None) -> dict[int, int]:
    """Object id per label."""
    room = MAX_OBJECTS if target is not None else MAX_OBJECTS - 1
    if len(present) > room:
        raise InputError(
            f"{raw.where}: {len(present)} instances in labels, but at most {room} fit. Leave out distant or tiny ones."
        )
    others = [k for k in present if k != target]
    ids = {k: k for k in others if 0 < k < MAX_OBJECTS}
    free = [i for i in range(1, MAX_OBJECTS) if i not in ids]
    ids |= dict(zip([k for k in others if k not in ids], free))
    if target is not None:
        ids[target] = TARGET_ID
    return ids

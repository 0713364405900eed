"""From a file's own labels to object ids: the target is 0, and labels 1..63 keep their numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16

from torc.errors import InputError
from torc.pipeline.frames.record import HIDDEN, RawFrame
from torc.pipeline.frames.values import as_names, as_whole
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
    background, robot = _special_labels(raw)
    present = sorted(set(np.unique(raw.labels).tolist()) - {background, robot})
    _check(raw, present, background)
    target = _target_label(raw, present)
    ids = _numbered(raw, present, target)
    return LabelIds(ids, target is not None, _relabelled(raw.labels, ids, robot))


def _special_labels(raw: RawFrame) -> tuple[int, int]:
    """Labels of background and robot."""
    background = BACKGROUND if (raw.labels < 0).any() else 0
    return (
        as_whole(raw.key("background"), raw.settings.get("background", background)),
        as_whole(raw.key("robot"), raw.settings.get("robot", ROBOT)),
    )


def _check(raw: RawFrame, present: list[int], background: int) -> None:
    if not present:
        raise InputError(
            f"{raw.where}: labels are {background} (background) everywhere, so there is no object. Give one number per "
            "instance, and `background` if it is another number."
        )
    if present[0] < 0:
        raise InputError(
            f"{raw.where}: label {present[0]} is negative; say which is `background` and which `robot`."
        )


def _target_label(raw: RawFrame, present: list[int]) -> int | None:
    """The target's label, None if it is hidden."""
    given = raw.settings.get("target", 0 if 0 in present else None)
    if given is None:
        raise InputError(
            f"{raw.where}: there is no target. Give the target's label, one of {present[:20]}, or '{HIDDEN}' if it is "
            "not in sight."
        )
    if given == HIDDEN:
        return None
    if isinstance(given, str):
        names = as_names(raw.key("names"), raw.settings.get("names", {}))
        named = [k for k, name in names.items() if name == given]
        if not named:
            raise InputError(
                f"{raw.key('target')}: '{given}' is neither '{HIDDEN}' nor one of the names {sorted(names.values())}. "
                "Give the target's label."
            )
        given = named[0]
    label = as_whole(raw.key("target"), given)
    if label not in present:
        raise InputError(
            f"{raw.key('target')}: label {label} has no pixel; the labels are {present[:20]}. If the target is not in "
            f"sight, say '{HIDDEN}'."
        )
    return label


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


def _relabelled(labels: np.ndarray, ids: Mapping[int, int], robot: int) -> Int16[np.ndarray, "h w"]:
    """The label image in object ids."""
    values, inverse = np.unique(labels, return_inverse=True)
    new = [ids.get(v, ROBOT if v == robot else BACKGROUND) for v in values.tolist()]
    return np.array(new, dtype=np.int16)[inverse].reshape(labels.shape)

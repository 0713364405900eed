"""Check the fields of requests and answers: the right kinds and shapes, finite, rigid, probabilities; or an error that
says what is wrong.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from torc import InputError, TorcError

_ROTATION_TOLERANCE = 1e-2
_FAR_M = 100.0
_MOST_MASKS = 1000
_MOST_TEXT = 500


class Fields:
    """The fields of a request or an answer. Every method but `has` raises the error of `refuse` for an unusable one."""

    def __init__(self, values: Mapping[str, Any], refuse: Callable[[str], TorcError]) -> None:
        self.values, self.refuse = values, refuse

    def has(self, name: str) -> bool:
        """Check whether the field is there."""
        return self.values.get(name) is not None

    def array(self, name: str, shape: tuple[int | None, ...], kinds: str) -> np.ndarray:
        """Return an array of this shape (None: any length), of these kinds of numbers (as in dtype.kind)."""
        value = self.values.get(name)
        if isinstance(value, list):
            try:
                value = np.array(value)
            except ValueError:
                value = None
        if not isinstance(value, np.ndarray):
            raise self.refuse(f"there is no array '{name}' in it.")
        fits = value.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, value.shape))
        if not fits or value.dtype.kind not in kinds:
            expected = tuple("any" if n is None else n for n in shape)
            raise self.refuse(
                f"'{name}' is {value.dtype} of shape {value.shape}; it must be of shape {expected}, kind {kinds}."
            )
        return value

    def bytes(self, name: str, shape: tuple[int | None, ...]) -> UInt8[np.ndarray, "..."]:
        """Return a picture of this shape, 0 to 255."""
        array = self.array(name, shape, "u")
        if array.dtype != np.uint8 or not array.size:
            raise self.refuse(f"'{name}' must be uint8, and not empty.")
        return array

    def finite(self, name: str, shape: tuple[int | None, ...]) -> Float[np.ndarray, "..."]:
        """Return an array of finite numbers, float64."""
        array = self.array(name, shape, "iuf").astype(np.float64)
        if not np.isfinite(array).all():
            raise self.refuse(f"'{name}' holds numbers that are not finite.")
        return array

    def probabilities(self, name: str, count: int) -> Float[np.ndarray, "n"]:
        """Return that many numbers from 0 to 1; rounding errors beyond are clipped."""
        array = self.finite(name, (count,))
        if ((array < -1e-3) | (array > 1 + 1e-3)).any():
            raise self.refuse(f"'{name}' must be from 0 to 1.")
        return np.clip(array, 0.0, 1.0)

    def number(self, name: str) -> float:
        """Return a finite number."""
        value = self.values.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.refuse(f"'{name}' must be a finite number.")
        return float(value)

    def whole(self, name: str, least: int, most: int) -> int:
        """Return a whole number in a range."""
        value = self.values.get(name)
        if type(value) is not int or not least <= value <= most:
            raise self.refuse(f"'{name}' must be a whole number from {least} to {most}.")
        return value

    def pose(self, name: str) -> Float[np.ndarray, "4 4"]:
        """Return one rigid transform; see `poses`."""
        return self._rigid(name, self.finite(name, (4, 4))[None])[0]

    def poses(self, name: str) -> Float[np.ndarray, "n 4 4"]:
        """Return rigid transforms, metres; rotations that half precision rounded are made exact."""
        value = self.values.get(name)
        if (isinstance(value, list) and not value) or (isinstance(value, np.ndarray) and not value.size):
            return np.zeros((0, 4, 4))
        return self._rigid(name, self.finite(name, (None, 4, 4)))

    def _rigid(self, name: str, Ts: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n 4 4"]:
        if np.abs(Ts).max() > _FAR_M:
            raise self.refuse(f"'{name}' are further than {_FAR_M} m away.")
        R = Ts[:, :3, :3]
        off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max()
        last = np.abs(Ts[:, 3] - [0, 0, 0, 1]).max()
        if off > _ROTATION_TOLERANCE or last > 1e-6 or (np.linalg.det(R) < 0).any():
            raise self.refuse(
                f"'{name}' are not rigid poses: rotations are off by {off:.2g}, last rows by {last:.2g}."
            )
        U, _, Vt = np.linalg.svd(R)
        out = np.tile(np.eye(4), (len(Ts), 1, 1))
        out[:, :3, :3], out[:, :3, 3] = U @ Vt, Ts[:, :3, 3]
        return out


def request(values: Mapping[str, Any]) -> Fields:
    """Return the fields of a request, for a handler of the server."""
    return Fields(values, lambda why: InputError(f"This request cannot be answered: {why}"))


@dataclass(frozen=True)
class Masks:
    """Objects in a picture; the masks may have another size than the picture that was sent.

    Attributes:
        masks: one per object; they may overlap.
        scores: how surely each is one object, 0 to 1.
    """

    masks: Bool[np.ndarray, "n h w"]
    scores: Float32[np.ndarray, "n"]


@dataclass(frozen=True)
class Grasps:
    """Gripper poses, in the network's own gripper frame.

    Attributes:
        Ts: rigid; in the frame of the points that were sent.
        confidences: 0 to 1.
        widths_m: distance between the pads on the object; NaN if the server does not say.
        object_ids: owner of each grasp; -1 if the points were of one object.
    """

    Ts: Float[np.ndarray, "n 4 4"]
    confidences: Float[np.ndarray, "n"]
    widths_m: Float[np.ndarray, "n"]
    object_ids: Int[np.ndarray, "n"]


@dataclass(frozen=True)
class Motion:
    """A timed path, unchecked: times rise from 0 (seconds), positions in radians."""

    times_s: Float[np.ndarray, "t"]
    qpos: Float[np.ndarray, "t dof"]


def read_masks(answer: Fields) -> Masks:
    """Read masks (n, h, w; booleans, or 0 and 1) or labels (h, w; a mask's number, negative for none), and scores."""
    if answer.has("masks") == answer.has("labels"):
        raise answer.refuse("it must hold either 'masks' or 'labels'.")
    count = len(answer.array("scores", (None,), "iuf"))
    if count > _MOST_MASKS:
        raise answer.refuse(f"it holds {count} masks; {_MOST_MASKS} are the most.")
    scores = answer.probabilities("scores", count).astype(np.float32)
    if answer.has("masks"):
        given = answer.array("masks", (count, None, None), "biu")
        masks = given.astype(np.bool_)
        if (given != masks).any():
            raise answer.refuse("'masks' must be truth values, or 0 and 1.")
        return Masks(masks, scores)
    labels = answer.array("labels", (None, None), "iu")
    if (labels >= count).any():
        raise answer.refuse(f"'labels' go up to {labels.max()}, and there are {count} scores.")
    return Masks(labels == np.arange(count)[:, None, None], scores)


def read_disparity(
    answer: Fields,
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"] | None]:
    """Read the disparity of the left picture, and its confidence (0 to 1; None if the server has none).

    The disparity is in pixels of its own size, which may differ from the pictures'; 0 or not finite means none.
    """
    disparity, confidence = answer.array("disparity", (None, None), "f"), None
    if disparity.size == 0:
        raise answer.refuse("'disparity' is empty.")
    with np.errstate(over="ignore"):  # what is too large for float32 is infinite
        if answer.has("confidence"):
            confidence = answer.array("confidence", disparity.shape, "f").astype(np.float32)
        return disparity.astype(np.float32), confidence


def read_grasps(answer: Fields, of_scene: bool = False) -> Grasps:
    """Read grasps (n, 4, 4), confidences, widths if the server knows them; for a scene also object_ids."""
    Ts = answer.poses("grasps")
    n = len(Ts)
    widths, ids = np.full(n, np.nan), np.full(n, -1)
    if n == 0:
        return Grasps(Ts, widths, widths, ids)
    confidences = answer.probabilities("confidences", n)
    if answer.has("widths"):
        widths = answer.array("widths", (n,), "f").astype(np.float64)
        if (widths < 0).any() or np.isinf(widths).any():
            raise answer.refuse("'widths' must be metres, or NaN where they are not known.")
    if of_scene:
        ids = answer.array("object_ids", (n,), "iu").astype(np.int64)
    return Grasps(Ts, confidences, widths, ids)


def read_motion(answer: Fields, dof: int) -> Motion | str:
    """Read times (t) and positions (t, dof), or the reason why there is no motion."""
    if answer.has("failure"):
        return str(answer.values["failure"])[:_MOST_TEXT]
    times = answer.finite("times", (None,))
    if len(times) < 2 or times[0] != 0 or (np.diff(times) <= 0).any():
        raise answer.refuse("'times' must begin with 0 and rise.")
    return Motion(times, answer.finite("positions", (len(times), dof)))

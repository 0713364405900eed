"""What messages hold, checked: arrays of the right kind and shape, or an error that says what is not."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8

from torc import InputError, TorcError

_ROTATION_TOLERANCE = 1e-2
_FAR_M = 100.0
_MOST_TEXT = 500


class Fields:
    """What a request or an answer holds; every reader raises the error of `refuse` for what cannot be used."""

    def __init__(self, values: Mapping[str, Any], refuse: Callable[[str], TorcError]) -> None:
        self.values, self.refuse = values, refuse

    def has(self, name: str) -> bool:
        """Whether there is such a field."""
        return self.values.get(name) is not None

    def array(self, name: str, shape: tuple[int | None, ...], kinds: str) -> np.ndarray:
        """An array of these kinds of numbers and this shape, None for any length."""
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
            wanted = tuple("any" if n is None else n for n in shape)
            raise self.refuse(
                f"'{name}' is {value.dtype} of shape {value.shape}; it must be of shape {wanted}, kind {kinds}."
            )
        return value

    def bytes(self, name: str, shape: tuple[int | None, ...]) -> UInt8[np.ndarray, "..."]:
        """A picture of this shape, 0 to 255."""
        array = self.array(name, shape, "u")
        if array.dtype != np.uint8 or not array.size:
            raise self.refuse(
                f"'{name}' is {array.dtype} of shape {array.shape}; it must be uint8, and not empty."
            )
        return array

    def finite(self, name: str, shape: tuple[int | None, ...]) -> Float[np.ndarray, "..."]:
        """An array of finite numbers, float64."""
        array = self.array(name, shape, "iuf").astype(np.float64)
        if not np.isfinite(array).all():
            raise self.refuse(f"'{name}' holds numbers that are not finite.")
        return array

    def probabilities(self, name: str, count: int) -> Float[np.ndarray, "n"]:
        """So many numbers from 0 to 1; float noise beyond is cut off."""
        array = self.finite(name, (count,))
        if ((array < -1e-3) | (array > 1 + 1e-3)).any():
            raise self.refuse(f"'{name}' must be from 0 to 1.")
        return np.clip(array, 0.0, 1.0)

    def number(self, name: str) -> float:
        """A finite number."""
        value = self.values.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.refuse(f"'{name}' must be a finite number.")
        return float(value)

    def whole(self, name: str, least: int, most: int) -> int:
        """A whole number in a range."""
        value = self.values.get(name)
        if type(value) is not int or not least <= value <= most:
            raise self.refuse(f"'{name}' must be a whole number from {least} to {most}.")
        return value

    def pose(self, name: str) -> Float[np.ndarray, "4 4"]:
        """One rigid transform; see `poses`."""
        Ts = Fields({name: self.finite(name, (4, 4))[None]}, self.refuse)
        return np.asarray(Ts.poses(name)[0])

    def poses(self, name: str) -> Float[np.ndarray, "n 4 4"]:
        """Rigid transforms; rotations that are off by half precision's rounding are made exact."""
        value = self.values.get(name)
        if (isinstance(value, list) and not value) or (isinstance(value, np.ndarray) and not value.size):
            return np.zeros((0, 4, 4))
        Ts = self.finite(name, (None, 4, 4))
        if np.abs(Ts).max() > _FAR_M:
            raise self.refuse(f"'{name}' are further than {_FAR_M} m away.")
        R = Ts[:, :3, :3]
        off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max()
        if off > _ROTATION_TOLERANCE or (np.linalg.det(R) < 0).any():
            raise self.refuse(f"'{name}' are no rigid poses: their rotations are off by {off:.2g}.")
        if np.abs(Ts[:, 3] - [0, 0, 0, 1]).max() > 1e-6:
            raise self.refuse(f"'{name}' are no rigid poses: the last row must be 0 0 0 1.")
        U, _, Vt = np.linalg.svd(R)
        out = np.tile(np.eye(4), (len(Ts), 1, 1))
        out[:, :3, :3], out[:, :3, 3] = U @ Vt, Ts[:, :3, 3]
        return out

    def text(self, name: str) -> str:
        """A text, cut off where it is long."""
        return str(self.values.get(name))[:_MOST_TEXT]


def request(values: Mapping[str, Any]) -> Fields:
    """The fields of a request, for a handler of the server."""
    return Fields(values, lambda why: InputError(f"This request cannot be answered: {why}"))

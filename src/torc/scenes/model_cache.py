"""Models kept in memory, as many as a limit allows. Light to import."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torc.scenes.models import ObjectModel


class ModelCache:
    """The models used last, as long as their arrays together take no more than `max_bytes`, and one in any case."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes, self._bytes = max_bytes, 0
        self._kept: OrderedDict[Hashable, tuple[ObjectModel, int]] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, read: Callable[[], ObjectModel]) -> ObjectModel:
        """The model of a key, read if it is not kept."""
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                return self._kept[key][0]
        model = read()  # outside of the lock: it takes long, and may fail
        with self._lock:
            self._drop(key)
            self._kept[key] = model, _bytes_of(model)
            self._bytes += self._kept[key][1]
            while self._bytes > self._max_bytes and len(self._kept) > 1:
                self._drop(next(iter(self._kept)))
        return model

    def _drop(self, key: Hashable) -> None:
        if key in self._kept:
            self._bytes -= self._kept.pop(key)[1]


def _bytes_of(model: ObjectModel) -> int:
    arrays = [piece.vertices for piece in model.pieces]
    for v in model.visuals:
        arrays += [v.vertices, v.faces, v.uv, v.texture, v.normals]
    return sum(array.nbytes for array in arrays if array is not None)

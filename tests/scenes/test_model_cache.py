"""Models stay in memory as long as there is room for them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from torc.errors import InputError
from torc.scenes.library import load_object
from torc.scenes.model_cache import ModelCache
from torc.scenes.models import ObjectModel
from torc.scenes.object_files import save_object


def _model(name: str, px: int = 100) -> ObjectModel:
    die = load_object("die_red")
    texture = np.zeros((px, 1000, 3), np.uint8)
    return replace(die, name=name, visuals=(replace(die.visuals[0], texture=texture),))


class Reader:
    """Makes models; notes what it was asked for."""

    def __init__(self, cache: ModelCache) -> None:
        self._cache, self.read = cache, ""

    def get(self, name: str, px: int = 100) -> ObjectModel:
        def read() -> ObjectModel:
            self.read += name
            return _model(name, px)

        return self._cache.get(name, read)


def test_what_was_used_last_is_kept() -> None:
    reader = Reader(ModelCache(1_000_000))  # three of 300 kB
    assert reader.get("a") is reader.get("a")
    for name in "bcabcabc":
        assert reader.get(name).name == name
    assert reader.read == "abc"
    reader.get("d")  # a has not been used for longest
    for name in "bcd":
        reader.get(name)
    assert reader.read == "abcd"
    reader.get("a")
    assert reader.read == "abcda"


def test_large_ones_take_the_place_of_many_and_one_is_always_kept() -> None:
    reader = Reader(ModelCache(1_000_000))
    for name, px in (
        ("a", 100),
        ("b", 300),
        ("b", 300),
        ("a", 100),
        ("c", 900),
        ("c", 900),
        ("a", 100),
        ("a", 100),
    ):
        reader.get(name, px)
    assert reader.read == "abaca"


def test_what_cannot_be_read_is_not_kept() -> None:
    cache = ModelCache(1_000_000)

    def fail() -> ObjectModel:
        raise InputError("damaged")

    with pytest.raises(InputError, match="damaged"):
        cache.get("a", fail)
    assert cache.get("a", lambda: _model("a")).name == "a"


def test_stored_objects_are_kept_by_what_they_take(
    object_store: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("torc.scenes.object_store._LOADED", ModelCache(1_000_000))
    for name in "abcd":
        save_object(_model(name), object_store / name)
    first = {name: load_object(name) for name in "abcd"}
    assert load_object("d") is first["d"]
    assert load_object("a") is not first["a"]
